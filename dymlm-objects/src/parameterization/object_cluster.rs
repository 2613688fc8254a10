use dymlm_core::{BoundingBox, ConfigError};
use dymlm_geometry::{BoxCluster, BoxSegmenter, BoxView, NO_SAMPLE, SampleGrid, SegmentationConfig};

use super::Rival;
use crate::SizePrior;

/// Finds the samples of a box that belong to the object.
///
/// The cluster is chosen by its size, in which central samples weigh more, by how little of it continues
/// outside the box, as background does, and by how well it fills the box from side to side. Clusters at about
/// the same depth that end within the margin are parts of the object: legs below a seat.
#[derive(Debug, Clone)]
pub(super) struct ObjectCluster {
    segmenter: BoxSegmenter,
    /// Whether each cluster is a part of the object.
    is_part: Vec<bool>,
    /// Samples of the object, ascending.
    pub(super) members: Vec<u32>,
    /// For each sample, whether it is of the object.
    pub(super) is_member: Vec<bool>,
}

/// What is known of an object before it is found.
#[derive(Debug)]
pub(super) struct ClusterSearch<'a> {
    /// The detector's box.
    pub(super) bounding_box: BoundingBox,
    /// Whether it is a thing on which people sit.
    pub(super) is_seat: bool,
    /// The usual sizes of such things.
    pub(super) prior: Option<&'a SizePrior>,
    /// Largest distance in depth of the object's parts from its main cluster, metres.
    pub(super) reach: f32,
    /// Other things in the box.
    pub(super) rivals: Vec<Rival<'a>>,
}

impl ClusterSearch<'_> {
    /// Whether a cluster may be the object, given its distance in depth, `apart`, from a mover that occludes
    /// much of the box. A seat is at the mover's depth; in the box of any other thing, a cluster at that
    /// depth is only what is left of the mover.
    fn may_be_beside_mover(&self, apart: f32) -> bool {
        self.is_seat == (apart.abs() <= MOVER_REACH)
    }

    /// How likely a cluster is the object, apart from its size.
    fn factor(&self, grid: &SampleGrid, cluster: &BoxCluster) -> f32 {
        let mover = grid.masked_depth.filter(|_| grid.masked_share >= HIDDEN);
        if mover.is_some_and(|mover| !self.may_be_beside_mover(cluster.depth - mover)) {
            return 0.0;
        }
        if self.shows_rival(grid, cluster) {
            return 0.0;
        }
        let share = cluster.outside_share() / CONTAINED;
        let containment = 1.0 / (1.0 + share * share);
        let span = cluster.bounds(grid).map_or(0.0, |own| own.iou(&self.bounding_box) as f32);
        containment * (0.1 + span)
    }

    /// Whether a cluster is a part of the object whose main cluster is `main`.
    fn is_part(&self, grid: &SampleGrid, main: &BoxCluster, cluster: &BoxCluster) -> bool {
        let is_near = (cluster.depth - main.depth).abs() <= self.reach;
        cluster.inside > 0 && is_contained(cluster) && is_near && !self.shows_rival(grid, cluster)
    }

    /// Whether a cluster is another thing.
    fn shows_rival(&self, grid: &SampleGrid, cluster: &BoxCluster) -> bool {
        let Some(bounds) = cluster.bounds(grid) else { return false };
        self.rivals.iter().any(|rival| rival.is_shown_by(cluster, &bounds, &self.bounding_box))
    }
}

/// Most pixels of a box that are sampled, on a grid.
const MAX_SAMPLES: usize = 1600;
/// Width of the margin searched around the box, as a share of its longer side, 0..=1; at least 6 pixels. What
/// a cluster does outside tells things from their background.
const MARGIN_SHARE: f32 = 0.15;
/// Share of a box occluded by movers from which on the movers' depth tells where the object is.
const HIDDEN: f32 = 0.2;
/// Largest distance in depth of a seat from the person on it, and of a mover's remains from the mover,
/// metres. A lower value takes remains of people for things, a higher one takes what stands behind a person
/// for a seat.
const MOVER_REACH: f32 = 0.4;
/// Share of a cluster outside the box at which its score is halved, and above which it is not part of the
/// object and its samples outside the box are dropped. A lower value cuts off what a tight box leaves out, a
/// higher one adds background.
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

    /// Finds the object among the samples that are not on the ground.
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
        let is_part = |index, cluster| index == chosen || search.is_part(grid, main, cluster);
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

    /// How well the object fills the detector's box: the intersection over union of the box around its
    /// samples with the detector's.
    pub(super) fn fill(&self, grid: &SampleGrid, bounding_box: &BoundingBox) -> f64 {
        let members = self.members.iter().filter_map(|&index| grid.samples.get(index as usize));
        grid.bounds(members).map_or(0.0, |own| own.iou(bounding_box))
    }

    /// Whether a sample is of the object; `false` for [`NO_SAMPLE`].
    pub(super) fn holds(&self, sample: u32) -> bool {
        sample != NO_SAMPLE && self.is_member.get(sample as usize).copied().unwrap_or(false)
    }
}
