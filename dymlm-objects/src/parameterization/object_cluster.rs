use dymlm_core::{BoundingBox, ConfigError, Point, axial_noise};
use dymlm_geometry::{Clusters, Dbscan, DbscanConfig, DbscanScratch};

use super::ParameterizationConfig;
use super::window::{NONE, Window};
use crate::SizePrior;

/// Finds the samples of a window that are the object.
///
/// DBSCAN runs in the coordinates (column, row, depth), each divided by its own radius: what the image parts is parted,
/// and depths count by their noise. The cluster is chosen by its size, each sample weighted by how central it lies, by
/// how little of it goes on outside the box, as background does, and by how well it fills the box from side to side.
/// Clusters at about the same depth that end within the window are parts of the object: legs below a seat.
#[derive(Debug)]
pub(super) struct ObjectCluster {
    dbscan: Dbscan,
    scratch: DbscanScratch,
    clusters: Clusters,
    points: Vec<Point>,
    /// The sample of each point.
    sample_of: Vec<u32>,
    stats: Vec<ClusterStats>,
    /// Whether each cluster is a part of the object.
    is_part: Vec<bool>,
    depths: Vec<f32>,
    /// Samples of the object, ascending.
    pub(super) members: Vec<u32>,
    /// Whether each sample is one.
    pub(super) is_member: Vec<bool>,
}

#[derive(Debug, Clone, Copy)]
struct ClusterStats {
    inside: f32,
    outside: f32,
    centrality: f32,
    depth: f32,
    low: [u32; 2],
    high: [u32; 2],
}

/// What is known of an object before it is found.
#[derive(Debug)]
pub(super) struct ClusterSearch<'a> {
    /// The detector's box.
    pub(super) bounding_box: BoundingBox,
    /// The boxes of the frame's other detections.
    pub(super) others: &'a [BoundingBox],
    /// Whether it is something that people sit on.
    pub(super) is_seat: bool,
    /// How large such things are.
    pub(super) prior: Option<&'a SizePrior>,
    /// How far from the object's depth its parts may be, metres.
    pub(super) reach: f32,
    pub(super) focal_length: f32,
}

impl ClusterSearch<'_> {
    /// What sits so far from a mover that hides much of the box: a seat is at its depth; what nobody sits on is not, but what
    /// is left of the mover is.
    fn mover_factor(&self, apart: f32) -> f32 {
        match (self.is_seat, apart.abs() <= if self.is_seat { SEAT_REACH } else { MOVER_REACH }) {
            (true, true) | (false, false) => 1.0,
            (true, false) => 0.0,
            (false, true) => MOVER_REST,
        }
    }

    /// How usual the size is that the box has at a depth, 0..=1: log-normal, two deviations from the least to the usual and on
    /// to the greatest.
    fn size_factor(&self, prior: &SizePrior, depth: f32) -> f32 {
        let metres_per_pixel = depth / self.focal_length;
        let (wide, high) =
            (self.bounding_box.width() * metres_per_pixel, self.bounding_box.height() * metres_per_pixel);
        // A flat thing's height in the image is some of its depth.
        let diagonal = |length: f64, width: f64, height: f64| {
            (length * length + width * width + height * height).sqrt() as f32
        };
        let usual = diagonal(prior.length.typical, prior.width.typical, prior.height.typical);
        let least = diagonal(prior.length.min, prior.width.min, prior.height.min);
        let most = diagonal(prior.length.max, prior.width.max, prior.height.max);
        let deviation = 0.25 * (most / least).ln().max(0.2);
        // What is cut or hidden may be small, but not large.
        let excess = (wide.hypot(high) / usual).ln().max(0.0) / deviation;
        (-0.5 * excess * excess).exp()
    }
}

const NOTHING: ClusterStats =
    ClusterStats { inside: 0.0, outside: 0.0, centrality: 0.0, depth: 0.0, low: [u32::MAX; 2], high: [0; 2] };

/// Share of a box hidden by movers from which on they tell where the thing is.
const HIDDEN: f32 = 0.2;
/// How far a seat may be from who sits on it, in depth, metres.
const SEAT_REACH: f32 = 0.5;
/// What is nearer to a mover than this, in depth, metres, may be a rest of it; its score is multiplied by so much.
const MOVER_REACH: f32 = 0.25;
const MOVER_REST: f32 = 0.1;
/// Share of a cluster outside the box at which its score is halved.
const OUTSIDE_SCALE: f32 = 0.12;
/// Largest share of a cluster outside the box for it to be a part, or to be taken with what lies outside.
const CONTAINED: f32 = 0.2;

impl ObjectCluster {
    pub(super) fn new(config: &ParameterizationConfig) -> Result<Self, ConfigError> {
        let mut dbscan = DbscanConfig::default();
        dbscan.eps = 1.0;
        dbscan.min_points = config.min_points;
        Ok(Self {
            dbscan: Dbscan::new(dbscan)?,
            scratch: DbscanScratch::new(),
            clusters: Clusters::new(),
            points: Vec::new(),
            sample_of: Vec::new(),
            stats: Vec::new(),
            is_part: Vec::new(),
            depths: Vec::new(),
            members: Vec::new(),
            is_member: Vec::new(),
        })
    }

    /// Finds the object among the samples that are no ground.
    pub(super) fn find(
        &mut self,
        window: &Window,
        is_ground: &[bool],
        search: &ClusterSearch<'_>,
        config: &ParameterizationConfig,
    ) {
        self.members.clear();
        self.is_member.clear();
        self.is_member.resize(window.samples.len(), false);
        self.lay(window, is_ground, search.focal_length, config);
        self.dbscan.cluster_into(&self.points, &mut self.scratch, &mut self.clusters);
        self.describe(window);
        if let Some(chosen) = self.choose(window, search) {
            self.keep(window, chosen, search);
        }
    }

    fn lay(
        &mut self,
        window: &Window,
        is_ground: &[bool],
        focal_length: f32,
        config: &ParameterizationConfig,
    ) {
        self.points.clear();
        self.sample_of.clear();
        self.depths.clear();
        let free = || window.samples.iter().zip(is_ground).enumerate().filter(|(_, (_, ground))| !**ground);
        self.depths.extend(
            free().filter(|(_, (sample, _))| sample.is_in_box).map(|(_, (sample, _))| sample.point[2]),
        );
        let middle = self.depths.len() / 2;
        if self.depths.is_empty() {
            return;
        }
        let z = *self.depths.select_nth_unstable_by(middle, f32::total_cmp).1;
        let slope = 2.0 * window.stride as f32 * z / focal_length;
        let eps_depth = (config.eps_depth + 2.0 * axial_noise(z) + slope).max(1e-6);
        for (index, (sample, _)) in free() {
            let [column, row] = [sample.column, sample.row].map(|cell| cell as f32 / config.eps_samples);
            self.points.push([column, row, sample.point[2] / eps_depth]);
            self.sample_of.push(index as u32);
        }
    }

    fn describe(&mut self, window: &Window) {
        self.stats.clear();
        self.stats.resize(self.clusters.count(), NOTHING);
        for (&sample, label) in self.sample_of.iter().zip(self.clusters.labels()) {
            let Some(stats) = label.and_then(|label| self.stats.get_mut(label as usize)) else { continue };
            let sample = &window.samples[sample as usize];
            if sample.is_in_box {
                stats.inside += 1.0;
                stats.depth += sample.point[2];
                stats.centrality += 0.05 + sample.centrality;
                let cell = [sample.column, sample.row];
                for ((low, high), cell) in stats.low.iter_mut().zip(&mut stats.high).zip(cell) {
                    *low = cell.min(*low);
                    *high = cell.max(*high);
                }
            } else {
                stats.outside += 1.0;
            }
        }
        for stats in &mut self.stats {
            stats.depth /= stats.inside.max(1.0);
        }
    }

    fn choose(&self, window: &Window, search: &ClusterSearch<'_>) -> Option<usize> {
        let score = |stats: &ClusterStats| {
            let mover = window.mover_depth.filter(|_| window.hidden_share >= HIDDEN);
            let beside_mover = mover.map_or(1.0, |mover| search.mover_factor(stats.depth - mover));
            let share = stats.outside / (stats.inside + stats.outside).max(1.0) / OUTSIDE_SCALE;
            let containment = 1.0 / (1.0 + share * share);
            let span = bounds(window, stats).map_or(0.0, |own| own.iou(&search.bounding_box) as f32);
            let size = search.prior.map_or(1.0, |prior| search.size_factor(prior, stats.depth));
            stats.centrality * containment * (0.1 + span) * size * beside_mover
        };
        let scored = self.stats.iter().map(score).enumerate();
        let best = scored.reduce(|best, next| if next.1 > best.1 { next } else { best })?;
        (best.1 > 0.0).then_some(best.0)
    }

    fn keep(&mut self, window: &Window, chosen: usize, search: &ClusterSearch<'_>) {
        let ClusterSearch { others, reach, .. } = *search;
        let main = self.stats[chosen];
        let is_part = |index: usize, stats: &ClusterStats| {
            let contained = stats.outside <= CONTAINED * (stats.inside + stats.outside);
            let of_another =
                || bounds(window, stats).is_some_and(|own| others.iter().any(|other| own.iou(other) > 0.3));
            index == chosen || (contained && (stats.depth - main.depth).abs() <= reach && !of_another())
        };
        self.is_part.clear();
        self.is_part.extend(self.stats.iter().enumerate().map(|(index, stats)| is_part(index, stats)));
        for (&index, label) in self.sample_of.iter().zip(self.clusters.labels()) {
            let Some(label) = label.map(|label| label as usize) else { continue };
            let stats = self.stats[label];
            let contained = stats.outside <= CONTAINED * (stats.inside + stats.outside);
            let sample = &window.samples[index as usize];
            if self.is_part[label] && (sample.is_in_box || (contained && sample.is_beside_box)) {
                self.members.push(index);
                self.is_member[index as usize] = true;
            }
        }
    }

    /// How well the object fills the detector's box from side to side: intersection over union of the box around its samples.
    pub(super) fn fill(&self, window: &Window, bounding_box: &BoundingBox) -> f64 {
        let mut stats = NOTHING;
        for sample in self.members.iter().filter_map(|&index| window.samples.get(index as usize)) {
            stats.inside += 1.0;
            let cell = [sample.column, sample.row];
            for ((low, high), cell) in stats.low.iter_mut().zip(&mut stats.high).zip(cell) {
                *low = cell.min(*low);
                *high = cell.max(*high);
            }
        }
        bounds(window, &stats).map_or(0.0, |own| own.iou(bounding_box))
    }

    /// Whether the sample of a cell is of the object.
    pub(super) fn holds(&self, sample: u32) -> bool {
        sample != NONE && self.is_member.get(sample as usize).copied().unwrap_or(false)
    }
}

/// The box around a cluster's samples within the detection's, pixels.
fn bounds(window: &Window, stats: &ClusterStats) -> Option<BoundingBox> {
    if stats.inside == 0.0 {
        return None;
    }
    let half = 0.5 * window.stride as f32;
    let [low, high] =
        [stats.low, stats.high].map(|[column, row]| window.pixel(column as usize, row as usize));
    let [left, top] = low.map(|c| c as f32 - half);
    let [right, bottom] = high.map(|c| c as f32 + half);
    BoundingBox::new(left, top, right, bottom).ok()
}
