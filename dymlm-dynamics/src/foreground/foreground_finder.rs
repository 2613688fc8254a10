use dymlm_core::{BoundingBox, ConfigError, Frame, Mask, SensorModel};
use dymlm_geometry::{BoxSegmenter, BoxView, SampleGrid, SegmentationConfig};

use super::Foreground;
use super::choice::{Candidates, Choice, Chosen, ExpectedBox, FOOT_REACH, ends_in_margin, is_part};
use super::cluster_motion::ClusterMotion;
use crate::miss_compensation::gone_since_detected;
use crate::{ComparedFrame, Mover};

/// How far the mover's surface may reach before and behind its median depth, metres: an outstretched arm; the
/// feet.
const REACH: [f32; 2] = [0.6, FOOT_REACH];
/// Least share of a cluster's samples that must lie in long free space for all of the cluster to be new. With
/// less, a desk is removed with the cup that was put there; with more, those parts of a mover remain whose
/// space was never seen free.
const NEW_SHARE: f32 = 0.3;

/// Finds the mover among the pixels of its box: paper section III-A, "DBSCAN to extract foreground points".
///
/// A [`BoxSegmenter`] clusters the readings of the box and of a margin around it, and [`Choice`] picks one of
/// the clusters.
///
/// Other clusters at the mover's depth that end within the margin are parts of the mover, cut off by an
/// occluder, another limb or a gap without depth: legs seen through the back of a chair, or a foot beside the
/// box. So are clusters of any depth that have [surely moved](ClusterMotion) and lie mostly in the box.
///
/// Costs O(n log n) for n samples; a person has a few thousand.
#[derive(Debug)]
pub(crate) struct ForegroundFinder {
    sensor: SensorModel,
    grid: SampleGrid,
    segmenter: BoxSegmenter,
    depths: Vec<f32>,
    choice: Choice,
    motion: ClusterMotion,
    /// Samples of each cluster that are new.
    new_samples: Vec<usize>,
}

/// Where to look for a foreground, and what is known of the mover.
#[derive(Debug, Clone, Copy)]
pub(crate) struct ForegroundSearch<'a> {
    /// The mover, with its box and the depth at which it should be.
    pub(crate) mover: &'a Mover,
    /// The pixels in the box of any mover, of the frame's size.
    pub(crate) boxes: &'a Mask,
    /// The detector's instance mask: only its pixels are used.
    pub(crate) instance_mask: Option<&'a Mask>,
}

impl ForegroundFinder {
    /// Makes a finder.
    pub(crate) fn new(sensor: &SensorModel) -> Result<Self, ConfigError> {
        let mut segmentation = SegmentationConfig::default();
        // A person that fills the image has some thousand samples.
        segmentation.spacing = 4.0;
        // As far as the sides of boxes move by default.
        segmentation.margin = 50.0;
        segmentation.margin_share = 0.0;
        segmentation.is_smoothed = false;
        // 0.02 would join people with what they walk past.
        segmentation.eps_depth = 0.01;
        Ok(Self {
            // Movers beyond the depth range of the maps are masked too: they occlude what is within it.
            sensor: SensorModel { min_depth: 0.0, max_depth: f32::MAX, ..*sensor },
            segmenter: BoxSegmenter::new(segmentation)?,
            grid: SampleGrid::default(),
            depths: Vec::new(),
            choice: Choice::default(),
            motion: ClusterMotion::default(),
            new_samples: Vec::new(),
        })
    }

    /// Finds the foreground of a box. It is empty when the box is empty or nothing in it has a depth.
    pub(crate) fn find(
        &mut self,
        compared: &ComparedFrame<'_>,
        search: &ForegroundSearch<'_>,
        foreground: &mut Foreground,
    ) {
        let (frame, mover) = (compared.frame, search.mover);
        let view =
            BoxView::new(frame, &self.sensor, mover.bounding_box).with_instance_mask(search.instance_mask);
        self.find_background(frame, &view, foreground);
        self.cluster(foreground);
        self.motion.compare(compared, &self.grid, &self.segmenter);
        let gone = gone_since_detected(mover, frame.camera());
        if let Some(chosen) = self.choose(search.boxes, mover, gone) {
            self.keep(chosen, foreground);
        }
        foreground.set_step(&self.sensor, 1.0 / frame.camera().fx().abs());
    }

    /// Finds what is new in a box: the clusters of whose samples more than [`NEW_SHARE`] are new. `is_new`
    /// takes a place in the camera's frame.
    pub(crate) fn find_new(
        &mut self,
        frame: &Frame,
        bounding_box: BoundingBox,
        static_mask: &Mask,
        is_new: impl Fn([f64; 3]) -> bool,
        foreground: &mut Foreground,
    ) {
        let view = BoxView::new(frame, &self.sensor, bounding_box).with_static_mask(Some(static_mask));
        self.find_background(frame, &view, foreground);
        foreground.background.drop_new(&self.grid, &is_new);
        self.cluster(foreground);
        let (grid, clusters) = (&self.grid, self.segmenter.clusters());
        self.new_samples.clear();
        self.new_samples.resize(clusters.len(), 0);
        let members = || self.segmenter.members().map(|(sample, cluster)| (&grid.samples[sample], cluster));
        for (sample, cluster) in members() {
            self.new_samples[cluster] += usize::from(is_new(sample.point.map(f64::from)));
        }
        let new_samples = &self.new_samples;
        let is_part =
            |cluster: usize| new_samples[cluster] as f32 > NEW_SHARE * clusters[cluster].size() as f32;
        let new = || members().filter(|(_, cluster)| is_part(*cluster)).map(|(sample, _)| sample);
        if let Some(median) = percentile(&mut self.depths, new().map(|sample| sample.point[2]), 0.5) {
            foreground.start(median);
            for sample in new() {
                foreground.add(sample.column as usize, sample.row as usize, sample.point[2]);
            }
        }
        foreground.set_step(&self.sensor, 1.0 / frame.camera().fx().abs());
    }

    /// Samples a box, and finds the planes that continue around it.
    fn find_background(&mut self, frame: &Frame, view: &BoxView<'_>, foreground: &mut Foreground) {
        self.segmenter.sample(view, &mut self.grid);
        foreground.clear(&self.grid);
        foreground.background.find(&self.grid, frame.camera(), &self.sensor);
    }

    /// Clusters the samples that are not background.
    fn cluster(&mut self, foreground: &Foreground) {
        let (samples, background) = (&self.grid.samples, &foreground.background);
        let is_free = |index: usize| {
            samples.get(index).is_some_and(|sample| !background.has_cell(sample.column, sample.row))
        };
        self.segmenter.cluster(&self.grid, is_free);
    }

    /// Chooses the largest cluster of a mover that may have `gone` so many pixels since it was detected.
    fn choose(&mut self, boxes: &Mask, own: &Mover, gone: Option<f32>) -> Option<Chosen> {
        let in_box = || self.grid.samples.iter().filter(|sample| sample.is_in_box);
        let nearest = percentile(&mut self.depths, in_box().map(|sample| sample.point[2]), 0.05)?;
        let expected_box = gone.zip(self.grid.bounds(in_box()));
        let expected_box = expected_box.map(|(gone, bounds)| ExpectedBox { bounds, gone });
        self.choice.choose(&Candidates {
            grid: &self.grid,
            segmenter: &self.segmenter,
            boxes,
            expected_box,
            expected_depth: own.depth,
            nearest,
            motion: &self.motion,
        })
    }

    /// Writes the mover's samples into the foreground: those of the chosen cluster, of all its parts, and of
    /// what moves in the box. Of a chosen cluster that continues outside the margin, only the samples in the
    /// box are kept.
    fn keep(&mut self, chosen: Chosen, foreground: &mut Foreground) {
        let (grid, clusters) = (&self.grid, self.segmenter.clusters());
        let members = || self.segmenter.members().map(|(sample, cluster)| (&grid.samples[sample], cluster));
        let in_box = members().filter(|(sample, cluster)| sample.is_in_box && *cluster == chosen.index);
        let in_box = in_box.map(|(sample, _)| sample.point[2]);
        let Some(median) = percentile(&mut self.depths, in_box, 0.5) else { return };
        let reach = median - REACH[0]..=median + REACH[1];
        let size = clusters[chosen.index].size();

        foreground.likelihood = chosen.likelihood;
        foreground.start(median);
        for (sample, index) in members() {
            let (cluster, z) = (&clusters[index], sample.point[2]);
            let is_of_mover = if index == chosen.index {
                reach.contains(&z) && (sample.is_in_box || ends_in_margin(cluster))
            } else {
                let moves = self.motion.was_elsewhere(index) && cluster.inside >= cluster.outside;
                moves || reach.contains(&z) && is_part(cluster, median, size)
            };
            if is_of_mover {
                foreground.add(sample.column as usize, sample.row as usize, z);
            }
        }
    }
}

/// The value below which a `share` of the values lies; `None` when there are no values.
fn percentile(buffer: &mut Vec<f32>, values: impl Iterator<Item = f32>, share: f32) -> Option<f32> {
    buffer.clear();
    buffer.extend(values);
    let rank = (share * buffer.len() as f32) as usize;
    (rank < buffer.len()).then(|| *buffer.select_nth_unstable_by(rank, f32::total_cmp).1)
}
