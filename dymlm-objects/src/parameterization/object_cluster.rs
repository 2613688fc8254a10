use dymlm_core::{BoundingBox, ConfigError};
use dymlm_geometry::{BoxCluster, BoxSegmenter, BoxView, NO_SAMPLE, SampleGrid, SegmentationConfig};

use crate::SizePrior;

/// Finds the samples of a box that are the object.
///
/// The cluster is chosen by its size, each sample weighted by how central it lies, by how little of it goes
/// on outside the box, as background does, and by how well it fills the box from side to side. Clusters at
/// about the same depth that end within the margin are parts of the object: legs below a seat.
#[derive(Debug, Clone)]
pub(super) struct ObjectCluster {
    segmenter: BoxSegmenter,
    /// Whether each cluster is a part of the object.
    is_part: Vec<bool>,
    /// Samples of the object, ascending.
    pub(super) members: Vec<u32>,
    /// Whether each sample is one.
    pub(super) is_member: Vec<bool>,
}

/// What is known of an object before it is found.
#[derive(Debug)]
pub(super) struct ClusterSearch<'a> {
    /// The detector's box.
    pub(super) bounding_box: BoundingBox,
    /// Whether it is something that people sit on.
    pub(super) is_seat: bool,
    /// How large such things are.
    pub(super) prior: Option<&'a SizePrior>,
    /// How far from the object's depth its parts may be, metres.
    pub(super) reach: f32,
}

impl ClusterSearch<'_> {
    /// Whether a cluster so far, in depth, from a mover that hides much of the box can be the thing: a seat
    /// is at its depth; at that of what nobody sits on is only what is left of the mover.
    fn may_be_beside_mover(&self, apart: f32) -> bool {
        self.is_seat == (apart.abs() <= MOVER_REACH)
    }

    /// How likely a cluster is the object, beside its size.
    fn factor(&self, grid: &SampleGrid, cluster: &BoxCluster) -> f32 {
        let mover = grid.masked_depth.filter(|_| grid.masked_share >= HIDDEN);
        if mover.is_some_and(|mover| !self.may_be_beside_mover(cluster.depth - mover)) {
            return 0.0;
        }
        let share = cluster.outside_share() / CONTAINED;
        let containment = 1.0 / (1.0 + share * share);
        let span = cluster.bounds(grid).map_or(0.0, |own| own.iou(&self.bounding_box) as f32);
        containment * (0.1 + span)
    }

    /// Whether a cluster is a part of the object whose main cluster is `main`.
    fn is_part(&self, main: &BoxCluster, cluster: &BoxCluster) -> bool {
        cluster.inside > 0 && is_contained(cluster) && (cluster.depth - main.depth).abs() <= self.reach
    }
}

/// Pixels of a box that are looked at, at most (a grid of them).
const MAX_SAMPLES: usize = 1600;
/// How far around the box is looked, as a share of its longer side, 0..=1; at least 6 pixels. What a cluster
/// does outside tells things from their background.
const MARGIN_SHARE: f32 = 0.15;
/// Share of a box hidden by movers from which on they tell where the thing is.
const HIDDEN: f32 = 0.2;
/// How far a seat may be from who sits on it, in depth, and what is left of a mover from it, metres. Lower
/// takes rests of people for things, higher what stands behind a person for a seat.
const MOVER_REACH: f32 = 0.4;
/// Share of a cluster outside the box at which its score is halved, and from which on it is no part of the
/// object, nor taken with what lies outside. Lower cuts off what a tight box leaves out, higher takes in the
/// background.
const CONTAINED: f32 = 0.15;

fn is_contained(cluster: &BoxCluster) -> bool {
    cluster.outside_share() <= CONTAINED
}

impl ObjectCluster {
    pub(super) fn new() -> Result<Self, ConfigError> {
        let mut config = SegmentationConfig::default();
        config.max_samples = MAX_SAMPLES;
        config.margin_share = MARGIN_SHARE;
        Ok(Self {
            segmenter: BoxSegmenter::new(config)?,
            is_part: Vec::new(),
            members: Vec::new(),
            is_member: Vec::new(),
        })
    }

    /// Samples a box and its surroundings.
    pub(super) fn sample(&self, view: &BoxView<'_>, grid: &mut SampleGrid) {
        self.segmenter.sample(view, grid);
    }

    /// Finds the object among the samples that are no ground.
    pub(super) fn find(&mut self, grid: &SampleGrid, is_ground: &[bool], search: &ClusterSearch<'_>) {
        self.members.clear();
        self.is_member.clear();
        self.is_member.resize(grid.samples.len(), false);
        self.segmenter.cluster(grid, |sample| is_ground.get(sample) == Some(&false));
        let chosen =
            self.segmenter.best(grid, |sample| sample.centrality, |cluster| search.factor(grid, cluster));
        if let Some(chosen) = chosen {
            self.keep(grid, chosen, search);
        }
    }

    fn keep(&mut self, grid: &SampleGrid, chosen: usize, search: &ClusterSearch<'_>) {
        let clusters = self.segmenter.clusters();
        let Some(main) = clusters.get(chosen) else { return };
        let is_part = |index, cluster| index == chosen || search.is_part(main, cluster);
        self.is_part.clear();
        self.is_part.extend(clusters.iter().enumerate().map(|(index, cluster)| is_part(index, cluster)));
        for (index, cluster) in self.segmenter.members().filter(|&(_, cluster)| self.is_part[cluster]) {
            let sample = &grid.samples[index];
            if sample.is_in_box || (sample.is_beside_box && is_contained(&clusters[cluster])) {
                self.members.push(index as u32);
                self.is_member[index] = true;
            }
        }
    }

    /// How well the object fills the detector's box from side to side: intersection over union of the box
    /// around its samples.
    pub(super) fn fill(&self, grid: &SampleGrid, bounding_box: &BoundingBox) -> f64 {
        let members = self.members.iter().filter_map(|&index| grid.samples.get(index as usize));
        grid.bounds(members).map_or(0.0, |own| own.iou(bounding_box))
    }

    /// Whether the sample of a cell is of the object.
    pub(super) fn holds(&self, sample: u32) -> bool {
        sample != NO_SAMPLE && self.is_member.get(sample as usize).copied().unwrap_or(false)
    }
}
