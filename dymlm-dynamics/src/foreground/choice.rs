use dymlm_core::{BoundingBox, Mask};
use dymlm_geometry::{BoxCluster, BoxSegmenter, SampleGrid};

use super::cluster_motion::ClusterMotion;
use crate::miss_compensation::DEPTH_CHANGE;

/// Largest number of samples at which the margin may cut a cluster that is part of a mover, in square roots
/// of the cluster's size. Furniture and walls, which continue outside, have 2 to 4, limbs 0. With 0.5 pieces
/// of furniture become parts of people (`kitchen_people`: precision .849 to .833).
const MAX_CUT: f32 = 0.35;
/// How far the mean depth of another cluster may lie before and behind the mover's depth for the cluster to
/// be part of the mover, metres: a forearm before the body; a leg behind it when the person leans.
const PART_REACH: [f32; 2] = [0.35, 0.5];
/// How far a foot may lie behind the mover's depth, metres, when a sitting person is seen from behind and the
/// chair is nearer still. With 0.6 those feet stay in the map
/// (`feet_beyond_a_chair_belong_to_who_sits_on_it`), with 0.9 more of the desk is removed.
pub(super) const FOOT_REACH: f32 = 0.75;
/// Largest cluster beyond that range that still counts as a part, a foot, when most of it lies in the box; as
/// a share of the mover's samples. With 0.1 more of the furniture behind people is removed
/// (`kitchen_people`), with 0.03 feet stay.
const FOOT_SHARE: f32 = 0.05;
/// Typical distance from a side of a detector's box to the end of the mover as seen, as a share of the box's
/// length (`who_is_seen_above_and_below_a_screen_is_not_the_screen`).
const SIDE_ERROR: f32 = 0.1;
/// Cap on a side's error, in units of `SIDE_ERROR`: beyond it the side is simply wrong, and by how much says
/// nothing (`who_is_cut_by_the_image_is_not_the_cabinet_in_the_middle_of_the_box`).
const LARGEST_ERROR: f32 = 3.0;
/// Share of the box at which a cluster is half as likely to be the mover as one that fills the box: a person
/// seen between the legs of a desk fills little, a speck next to nothing
/// (`specks_in_the_corners_of_a_box_are_nobody`; with 0.3 a desk is taken for a person in `evaluate
/// --fresh`).
const SMALL_SHARE: f32 = 0.05;
/// Likelihood that a part of a mover's surface has been still for seconds while another cluster has moved:
/// all but one to three per cent of the surface of people who sit moves (docs/decisions/10-still-parts.md).
/// With 1 the things before a person are taken for the person
/// (`who_sways_behind_a_thing_that_stays_is_the_mover_and_not_the_thing`; residue of
/// `fresh_6100301_sitting_6` .485 instead of .085 %); with 0 a person of whom nothing but a hand has moved
/// could never be found.
const STILL: f32 = 0.03;

/// Chooses, among the clusters of a box, the one that is the mover.
///
/// A cluster is judged together with the other clusters that would then be parts of the mover, by how likely
/// the detector would have put this box around them:
/// - they reach all four sides, because the detector sees the ends of the mover. A desk or a screen before a
///   person is nearer and larger than what is seen of the person, but leaves out the head above it and the
///   feet below. A predicted box says so too, the less the longer ago the mover was detected;
/// - they fill some of the box, and its middle counts more than its sides;
/// - they are at the depth at which the track is expected; for a new track, nearer is likelier;
/// - they move: what past views have shown in the same place for seconds, while another cluster has moved,
///   stands before the mover, as bottles on the table at which somebody sits;
/// - they do not continue outside the margin, as walls and tables do, nor into the boxes of other movers: a
///   person who sits before another reaches into the other's box.
///
/// Costs O(samples + clusters^2).
#[derive(Debug, Default)]
pub(super) struct Choice {
    clusters: Vec<Judged>,
}

/// What the choice needs to know of a cluster besides its shape.
#[derive(Debug, Clone, Copy, Default)]
struct Judged {
    /// Sum of the centrality of its samples in the box.
    mass: f32,
    /// The same sum, times [`STILL`] if the cluster has been still.
    moving: f32,
    /// That sum, each sample also weighted by how well its depth agrees with the expected one.
    expected: f32,
    /// Samples outside the box that lie in the boxes of other movers.
    others: usize,
    /// Samples at which the margin cuts it, without those in the boxes of other movers.
    cut: usize,
}

/// A candidate for the mover's largest cluster.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Chosen {
    pub(super) index: usize,
    /// How likely it is the mover, by its shape, by whether it moves, and by the expected depth, if there is
    /// one: 0..=1.
    pub(super) likelihood: f32,
    /// The same, but nearer is likelier when there is no expected depth.
    score: f32,
}

/// The box in which a mover should reach all four sides.
#[derive(Debug, Clone, Copy)]
pub(super) struct ExpectedBox {
    /// The part of the detected or predicted box that has readings.
    pub(super) bounds: BoundingBox,
    /// How far the mover may have gone since it was detected, pixels.
    pub(super) gone: f32,
}

/// What the choice is made from.
#[derive(Debug, Clone, Copy)]
pub(super) struct Candidates<'a> {
    pub(super) grid: &'a SampleGrid,
    pub(super) segmenter: &'a BoxSegmenter,
    /// The pixels in the box of any mover.
    pub(super) boxes: &'a Mask,
    /// `None` when nobody knows how far it may have gone.
    pub(super) expected_box: Option<ExpectedBox>,
    /// Depth at which the mover's track should be, metres.
    pub(super) expected_depth: Option<f32>,
    /// Depth of the nearest things in the box, metres.
    pub(super) nearest: f32,
    /// Which clusters have been still.
    pub(super) motion: &'a ClusterMotion,
}

impl Choice {
    /// The mover's largest cluster; `None` when there is none in the box.
    pub(super) fn choose(&mut self, candidates: &Candidates<'_>) -> Option<Chosen> {
        self.judge_samples(candidates);
        let scores = (0..self.clusters.len()).map(|index| self.score(index, candidates));
        // Of equal scores the first wins.
        let best = scores.reduce(|best, next| if next.score > best.score { next } else { best });
        best.filter(|best| best.score > 0.0)
    }

    fn judge_samples(&mut self, candidates: &Candidates<'_>) {
        let Candidates { grid, segmenter, boxes, .. } = candidates;
        self.clusters.clear();
        self.clusters.resize(segmenter.clusters().len(), Judged::default());
        for (sample, cluster) in segmenter.members() {
            let (sample, judged) = (&grid.samples[sample], &mut self.clusters[cluster]);
            if sample.is_in_box {
                judged.mass += sample.centrality;
                judged.expected += sample.centrality * candidates.expectation(sample.point[2]);
            } else {
                let [u, v] = grid.pixel(sample.column as usize, sample.row as usize);
                let is_others = boxes.at(u, v);
                judged.others += usize::from(is_others);
                judged.cut += usize::from(sample.is_cut && !is_others);
            }
        }
        for (cluster, judged) in self.clusters.iter_mut().enumerate() {
            let share = if candidates.motion.is_still(cluster) { STILL } else { 1.0 };
            judged.moving = share * judged.mass;
            judged.expected *= share;
        }
    }

    /// How likely a cluster is the mover's largest one: 0 when it has no weight, or when a cluster of more
    /// weight would be a part of it.
    fn score(&self, chosen: usize, candidates: &Candidates<'_>) -> Chosen {
        let clusters = candidates.segmenter.clusters();
        let own = &clusters[chosen];
        let (mut mass, mut moving, mut expected) = (0.0, 0.0, 0.0);
        let mut reached = [f32::NEG_INFINITY; 4];
        for (index, part) in clusters.iter().enumerate() {
            if index != chosen && !is_part(part, own.depth, own.size()) {
                continue;
            }
            let judged = &self.clusters[index];
            if judged.mass > self.clusters[chosen].mass {
                return Chosen::default();
            }
            mass += judged.mass;
            moving += judged.moving;
            expected += judged.expected;
            for (reached, side) in reached.iter_mut().zip(part.bounds(candidates.grid).iter().flat_map(sides))
            {
                *reached = side.max(*reached);
            }
        }
        let small = SMALL_SHARE * candidates.grid.box_cells as f32;
        // Without this factor a person behind a nearer sitter stays in the map (`evaluate --fresh`).
        let own_share = 1.0 - self.clusters[chosen].others as f32 / own.size().max(1) as f32;
        let shape = candidates.expected_box.map_or(1.0, |expected| expected.is_reached(reached))
            * own_share
            * likelihood(relative_cut(self.clusters[chosen].cut, own.size()) / MAX_CUT)
            / (mass + small);
        let known = if candidates.expected_depth.is_some() { expected } else { moving };
        Chosen { index: chosen, likelihood: known * shape, score: expected * shape }
    }
}

impl ExpectedBox {
    /// The likelihood that the mover of this box reaches so far outward on each side: 0..=1.
    fn is_reached(&self, reached: [f32; 4]) -> f32 {
        let Self { bounds, gone } = self;
        let [across, down] = [bounds.width(), bounds.height()].map(|length| gone.hypot(SIDE_ERROR * length));
        let errors = [across, down, across, down];
        let short = sides(bounds)
            .into_iter()
            .zip(reached)
            .zip(errors)
            .map(|((side, reached), error)| ((side - reached) / error).clamp(0.0, LARGEST_ERROR));
        short.map(likelihood).product()
    }
}

impl Candidates<'_> {
    /// How well a depth agrees with the depth at which the mover should be: 0..=1.
    fn expectation(&self, z: f32) -> f32 {
        match self.expected_depth {
            Some(expected) => likelihood((z - expected) / DEPTH_CHANGE as f32),
            None => (self.nearest / z).min(1.0).powi(2),
        }
    }
}

/// Whether a cluster is a part of the mover, given the depth (metres) and size (samples) of the mover's
/// largest cluster: it must be about as deep and end within the margin.
pub(super) fn is_part(cluster: &BoxCluster, depth: f32, size: usize) -> bool {
    let is_near = (depth - PART_REACH[0]..=depth + PART_REACH[1]).contains(&cluster.depth);
    let is_foot = (depth..=depth + FOOT_REACH).contains(&cluster.depth)
        && cluster.size() as f32 <= FOOT_SHARE * size as f32
        && cluster.inside >= cluster.outside;
    (is_near || is_foot) && ends_in_margin(cluster)
}

/// Whether a cluster ends within the margin.
pub(super) fn ends_in_margin(cluster: &BoxCluster) -> bool {
    relative_cut(cluster.cut, cluster.size()) <= MAX_CUT
}

/// Samples at which a cluster is cut, in square roots of its size.
fn relative_cut(cut: usize, size: usize) -> f32 {
    cut as f32 / (size.max(1) as f32).sqrt()
}

/// How far outward each side of a box lies: left, top, right, bottom; larger is farther outward.
fn sides(own: &BoundingBox) -> [f32; 4] {
    [-own.x_min(), -own.y_min(), own.x_max(), own.y_max()]
}

/// The likelihood of an error, in units of its typical size, with the long tails that detectors and trackers
/// have: 0..=1.
fn likelihood(error: f32) -> f32 {
    1.0 / (1.0 + error * error)
}
