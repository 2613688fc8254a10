use dymlm_core::{DepthImage, Mask, PinholeCamera, SensorModel};

use super::super::config::PlaneDetectorConfig;
use super::super::rays::Rays;
use super::super::reading_noise::ReadingNoise;
use super::bend::Bend;
use super::block_grid::BlockGrid;
use super::block_moments::sum_blocks;
use super::cluster::{Clustering, fit_of_both};
use super::growing::{Growing, Scene, Seed, sum_pixels};
use super::meetings::{Meeting, find_meetings, keep_close};
use super::segment::{Extraction, Segment};
use super::strip_profile::StripProfile;
use super::tolerance::{Tolerance, width};
use crate::error::Error;
use crate::moments::{Fit, Moments};

/// Least share of a block's pixels that must have a reading. (Feng 2014 requires all, but a Kinect leaves
/// holes.) With less, slivers at the rim of a pillar become planes (`a_cylinder_yields_no_plane`).
const MIN_BLOCK_FILL: f64 = 0.5;
/// A block is rough above this many times the expected variance: five standard deviations of the variance of
/// 64 readings. Without the rule the planes of random rooms are 0.1 mm and 0.03 degrees worse.
const ROUGH: f64 = 2.0;

/// Least contact of planes that meet, in sides of a block: a few stray pixels touch at every corner.
const CONTACT_IN_SIDES: u32 = 2;

/// Least size of a cluster from which a plane is grown, as a share of the least support: the plane gains the
/// rest at its rim.
const SEED_SHARE: f64 = 0.3;

/// Number of blocks on each side of a plane in which it is followed, to see whether it ends at an edge.
const SURROUNDINGS: usize = 2;

/// Finds the planes of a depth image by agglomerative clustering of its blocks.
///
/// Feng, Taguchi, Kamat: "Fast Plane Extraction in Organized Point Clouds Using Agglomerative Hierarchical
/// Clustering", ICRA 2014. The image is divided into blocks of 8x8 pixels. Flat blocks become the nodes of a
/// graph, pairs of neighbours its edges. Clusters merge as long as their common plane stays flat for the
/// noise at its depth. Then their rims are eroded and grown again pixel by pixel, and planes that meet and
/// agree merge. All fits come from moment sums, so merging two planes costs the same as merging two points.
/// Two tests are added, see `cluster.rs` and `growing.rs`: a small part must fit the common plane by itself,
/// and a flat block does not join a plane that cuts through it.
///
/// Lengths in pixels scale with the camera's focal length. O(pixels + blocks log blocks). The extractor owns
/// its buffers: after the first frame nothing is allocated.
#[derive(Debug, Clone)]
pub(in crate::detector) struct PlaneExtractor {
    block_size: usize,
    min_support: f64,
    sensor: SensorModel,
    tolerance: Tolerance,
    grid: BlockGrid,
    /// The camera's [`focal_scale`](PinholeCamera::focal_scale).
    scale: f64,
    rays: Rays,
    /// Depths in range and not masked; 0 elsewhere.
    depth: Vec<f32>,
    moments: Vec<Moments>,
    fits: Vec<Option<Fit>>,
    /// Roughness of the blocks, then the unevenness of neighbouring ones; relative to the sensor's variance.
    ratios: Vec<f64>,
    clustering: Clustering,
    /// Label of each cluster, by the cluster's number.
    cluster_labels: Vec<u16>,
    is_judged: Vec<bool>,
    block_labels: Vec<u16>,
    seeds: Vec<Seed>,
    /// Whether a label has a square of two by two blocks.
    is_wide: Vec<bool>,
    growing: Growing,
    sums: Vec<Moments>,
    /// Labels that meet.
    meetings: Vec<Meeting>,
    /// Final label of each label.
    relabelled: Vec<u16>,
    /// The bend of each label's plane, and its bend with the blocks around it.
    bends: Vec<Option<Bend>>,
    wider_bends: Vec<Option<Bend>>,
    /// The profile of each label's plane that is a strip; the first entry is for no label.
    profiles: Vec<Option<StripProfile>>,
    /// Pairs of a label and a block near its plane that is not part of it.
    surroundings: Vec<(u16, usize)>,
    extraction: Extraction,
}

impl PlaneExtractor {
    /// An extractor with empty buffers.
    pub(in crate::detector) fn new(config: &PlaneDetectorConfig, sensor: SensorModel) -> Self {
        Self {
            block_size: config.block_size,
            min_support: config.min_support as f64,
            sensor,
            tolerance: Tolerance::new(sensor),
            grid: BlockGrid::default(),
            scale: 1.0,
            rays: Rays::default(),
            depth: Vec::new(),
            moments: Vec::new(),
            fits: Vec::new(),
            ratios: Vec::new(),
            clustering: Clustering::default(),
            cluster_labels: Vec::new(),
            is_judged: Vec::new(),
            block_labels: Vec::new(),
            seeds: Vec::new(),
            is_wide: Vec::new(),
            growing: Growing::default(),
            sums: Vec::new(),
            meetings: Vec::new(),
            relabelled: Vec::new(),
            bends: Vec::new(),
            wider_bends: Vec::new(),
            profiles: Vec::new(),
            surroundings: Vec::new(),
            extraction: Extraction::default(),
        }
    }

    /// Finds the planes of an image. Pixels for which `static_mask` is false are ignored.
    ///
    /// # Errors
    ///
    /// [`Error::Core`] when the image or the mask has another size than the camera; the last extraction
    /// stays.
    pub(in crate::detector) fn extract(
        &mut self,
        camera: &PinholeCamera,
        depth: &DepthImage,
        static_mask: Option<&Mask>,
    ) -> Result<(), Error> {
        camera.check_size("the depth image", depth.width(), depth.height())?;
        if let Some(mask) = static_mask {
            camera.check_size("the static mask", mask.width(), mask.height())?;
        }
        self.grid = BlockGrid::new(camera, self.block_size);
        self.rays.set(camera);
        self.scale = camera.focal_scale();
        let noise = ReadingNoise::new(self.sensor, camera);

        self.read(depth, static_mask);
        self.fit_blocks();
        self.drop_rough_blocks(&noise);
        self.measure_unevenness();
        self.clustering.run(&self.grid, &self.moments, &self.fits, &self.tolerance);
        self.choose_seeds();
        self.find_wide();
        self.grow(noise);
        self.sum_planes();
        self.merge_planes();
        self.measure_bends();
        self.measure_wider_bends(camera);
        self.measure_profiles();
        self.write_planes();
        Ok(())
    }

    /// The last extraction.
    pub(in crate::detector) fn extraction(&self) -> &Extraction {
        &self.extraction
    }

    /// The rays of the last extraction's camera.
    pub(in crate::detector) fn rays(&self) -> &Rays {
        &self.rays
    }

    /// Selects the readings and sums them up, one row of blocks at a time, while they are still in the cache.
    fn read(&mut self, depth: &DepthImage, static_mask: Option<&Mask>) {
        self.depth.clear();
        self.moments.clear();
        for row in 0..self.grid.rows {
            let rows = self.grid.pixel_rows(row * self.grid.columns);
            let pixels = rows.start * self.grid.width..rows.end * self.grid.width;
            self.choose_readings(&depth.data()[pixels.clone()]);
            if let Some(mask) = static_mask {
                let chosen = self.depth[pixels.clone()].chunks_exact_mut(self.grid.width);
                rows.zip(chosen).for_each(|(v, row)| mask.overwrite_outside(v, row, 0.0));
            }
            sum_blocks(&self.depth[pixels], &self.grid, row, &self.rays, &mut self.moments);
        }
    }

    /// Copies depths; readings out of range become 0.
    fn choose_readings(&mut self, depths: &[f32]) {
        let sensor = self.sensor;
        self.depth.extend(depths.iter().map(|&z| if sensor.is_used(z) { z } else { 0.0 }));
    }

    fn fit_blocks(&mut self) {
        let tolerance = &self.tolerance;
        // Of a whole block: what the image's border leaves of one may be a single row of pixels.
        let least = MIN_BLOCK_FILL * (self.grid.side * self.grid.side) as f64;
        self.fits.clear();
        self.fits.extend(self.moments.iter().map(|moments| {
            if moments.weight < least {
                return None;
            }
            moments.fit().filter(|fit| tolerance.holds(fit))
        }));
    }

    /// Drops blocks that are rougher than the sensor's noise, because they contain a step or an edge. The
    /// ratio of the real noise to the sensor model is taken from the median block.
    fn drop_rough_blocks(&mut self, noise: &ReadingNoise) {
        let tolerance = &self.tolerance;
        let model = |fit: &Fit| tolerance.variance(fit.centroid[2]);
        self.ratios.clear();
        self.ratios.extend(self.fits.iter().flatten().map(|fit| fit.depth_mse / model(fit)));
        let middle = self.ratios.len() / 2;
        if middle == 0 {
            return;
        }
        let (_, &mut median, _) = self.ratios.select_nth_unstable_by(middle, f64::total_cmp);
        for fit in &mut self.fits {
            let is_rough = |fit: &Fit| {
                let explained = median * model(fit) + noise.lateral_variance_in_depth(fit);
                fit.depth_mse > ROUGH * explained
            };
            *fit = fit.filter(|fit| !is_rough(fit));
        }
    }

    /// Measures the misfit of neighbouring flat blocks to a common plane: the median of all pairs, most of
    /// which lie on one plane. With fewer than two pairs, as in a strip of a single row of blocks, none is
    /// known of: what the frame before had is not this frame's.
    fn measure_unevenness(&mut self) {
        self.ratios.clear();
        let below = self.grid.columns;
        for (block, pair) in self.fits.iter().zip(self.fits.iter().skip(below)).enumerate() {
            let other = block + below;
            if let (Some(a), Some(b)) = pair {
                let moments = [&self.moments[block], &self.moments[other]];
                self.ratios.extend(self.tolerance.unevenness_of(moments, [a, b]));
            }
        }
        let middle = self.ratios.len() / 2;
        let unevenness = if middle > 0 {
            *self.ratios.select_nth_unstable_by(middle, f64::total_cmp).1
        } else {
            Tolerance::UNMEASURED
        };
        self.tolerance.set_unevenness(unevenness);
    }

    /// Numbers the clusters that are large enough, in the order of their first blocks.
    fn choose_seeds(&mut self) {
        let count = self.grid.len();
        let smallest = SEED_SHARE * self.min_support();
        self.cluster_labels.clear();
        self.cluster_labels.resize(count, 0);
        self.is_judged.clear();
        self.is_judged.resize(count, false);
        self.block_labels.clear();
        self.seeds.clear();
        for block in 0..count {
            let mut label = 0;
            if self.fits[block].is_some() {
                let cluster = self.clustering.find(block);
                if !self.is_judged[cluster] {
                    self.is_judged[cluster] = true;
                    self.add_seed(cluster, smallest);
                }
                label = self.cluster_labels[cluster];
            }
            self.block_labels.push(label);
        }
    }

    /// Makes a cluster the seed of a plane, if it is large enough and not bent.
    fn add_seed(&mut self, cluster: usize, smallest: f64) {
        let (moments, fit) = (self.clustering.moments(cluster), self.clustering.fit(cluster));
        let noise = self.clustering.noise_mse(cluster);
        let has_room = self.seeds.len() < usize::from(u16::MAX);
        if has_room && moments.weight >= smallest && !self.tolerance.is_bent(width(moments), noise, fit) {
            self.seeds.push(Seed::new(fit, noise, self.sensor));
            self.cluster_labels[cluster] = self.seeds.len() as u16;
        }
    }

    /// Finds the planes that have a square of two by two blocks. The others are strips.
    fn find_wide(&mut self) {
        self.is_wide.clear();
        self.is_wide.resize(self.seeds.len() + 1, false);
        for block in 0..self.grid.len() {
            let label = self.block_labels[block];
            let [_, right, _, below] = self.grid.neighbors(block);
            if let (Some(right), Some(below)) = (right, below) {
                let square = [right, below, below + 1].map(|other| self.block_labels[other]);
                self.is_wide[usize::from(label)] |= square == [label; 3];
            }
        }
    }

    fn min_support(&self) -> f64 {
        self.min_support * self.scale * self.scale
    }

    fn grow(&mut self, noise: ReadingNoise) {
        let (width, height) = (self.grid.width, self.grid.height);
        (self.extraction.width, self.extraction.height) = (width, height);
        self.extraction.labels.clear();
        self.extraction.labels.resize(width * height, 0);
        let scene = Scene {
            depth: &self.depth,
            grid: &self.grid,
            rays: &self.rays,
            moments: &self.moments,
            fits: &self.fits,
            tolerance: &self.tolerance,
            noise,
            seeds: &self.seeds,
            block_labels: &self.block_labels,
            is_wide: &self.is_wide,
        };
        self.growing.run(&scene, &mut self.extraction.labels);
    }

    /// Sums the points of each label, and finds the labels that meet.
    fn sum_planes(&mut self) {
        self.sums.clear();
        self.sums.resize(self.seeds.len(), Moments::default());
        self.meetings.clear();
        for block in 0..self.grid.len() {
            let label = self.block_labels[block];
            if self.growing.is_core(block) {
                self.sums[usize::from(label) - 1].add(&self.moments[block]);
                // Each side once.
                let [_, right, _, below] = self.grid.neighbors(block);
                for other in [right, below].into_iter().flatten() {
                    if self.growing.is_core(other) && self.block_labels[other] != label {
                        let labels = [label, self.block_labels[other]];
                        self.meetings.push(Meeting::new(labels, self.grid.side as u32));
                    }
                }
                continue;
            }
            let meeting = self.growing.meeting_in(block);
            if meeting.is_empty() {
                continue;
            }
            sum_pixels(&self.depth, &self.grid, &self.rays, block, &self.extraction.labels, &mut self.sums);
            if meeting.len() > 1 {
                find_meetings(&self.grid, block, &self.extraction.labels, &mut self.meetings);
            }
        }
        keep_close(&mut self.meetings, CONTACT_IN_SIDES * self.grid.side as u32);
    }

    /// Merges planes that meet and agree, the flattest pair first. `relabelled` maps merged labels to the
    /// remaining ones.
    fn merge_planes(&mut self) {
        self.relabelled.clear();
        self.relabelled.extend(0..=self.seeds.len() as u16);
        while let Some((into, from)) = self.flattest_pair() {
            let moved = std::mem::take(&mut self.sums[usize::from(from) - 1]);
            self.sums[usize::from(into) - 1].add(&moved);
            self.is_wide[usize::from(into)] |= self.is_wide[usize::from(from)];
            for label in &mut self.relabelled {
                if *label == from {
                    *label = into;
                }
            }
        }
    }

    fn flattest_pair(&self) -> Option<(u16, u16)> {
        let mut best: Option<(f64, u16, u16)> = None;
        for meeting in &self.meetings {
            let [a, b] = sorted(meeting.labels.map(|label| self.relabelled[usize::from(label)]));
            let [of_a, of_b] = [a, b].map(|label| &self.sums[usize::from(label) - 1]);
            if a == b || of_a.weight < 10.0 || of_b.weight < 10.0 {
                continue;
            }
            let noise = [a, b].map(|label| self.seeds[usize::from(label) - 1].noise_mse);
            let Some(fit) = fit_of_both([of_a, of_b], noise, &self.tolerance) else { continue };
            if best.is_none_or(|(mse, ..)| fit.mse < mse) {
                best = Some((fit.mse, a, b));
            }
        }
        best.map(|(_, a, b)| (a, b))
    }

    /// Collects the sums for the bend of each plane, each reading weighted by 1 / sigma^2.
    fn measure_bends(&mut self) {
        self.bends.clear();
        self.bends.extend(self.sums.iter().map(|sums| sums.fit().map(Bend::new)));
        for block in 0..self.grid.len() {
            let label = usize::from(self.inner_label(block));
            if let Some(Some(bend)) = label.checked_sub(1).and_then(|label| self.bends.get_mut(label)) {
                let (moments, centroid) = (&self.moments[block], self.moments[block].centroid());
                bend.add(centroid, moments.weight / self.tolerance.variance(centroid[2]));
            }
        }
    }

    /// The label of a block that is whole in a plane, after merges; 0 for other blocks.
    fn core_label(&self, block: usize) -> u16 {
        if self.growing.is_core(block) { self.relabelled[usize::from(self.block_labels[block])] } else { 0 }
    }

    /// The label of a block whose middle is in a plane, after merges: one that is whole in it, or one of a
    /// strip.
    fn inner_label(&self, block: usize) -> u16 {
        let label = usize::from(self.block_labels[block]);
        let is_inner = self.growing.is_core(block) || !self.is_wide[label];
        if is_inner { self.relabelled[label] } else { 0 }
    }

    /// Adds to the bend of each plane the blocks around it that continue it.
    fn measure_wider_bends(&mut self, camera: &PinholeCamera) {
        self.wider_bends.clone_from(&self.bends);
        self.find_surroundings();
        // Their extent at depth 1.
        let extent = (SURROUNDINGS * self.grid.side) as f64 / camera.fx().abs();
        for &(label, block) in &self.surroundings {
            let (Some(bend), Some(fit)) = (&mut self.wider_bends[usize::from(label) - 1], &self.fits[block])
            else {
                continue;
            };
            let z = fit.centroid[2];
            if bend.is_continued_by(fit, extent * z) {
                bend.add(fit.centroid, self.moments[block].weight / self.tolerance.variance(z));
            }
        }
    }

    /// Lists the flat blocks that are at most [`SURROUNDINGS`] blocks beside, above or below a plane.
    fn find_surroundings(&mut self) {
        self.surroundings.clear();
        for block in 0..self.grid.len() {
            let label = self.inner_label(block);
            if label == 0 {
                continue;
            }
            for direction in 0..4 {
                let steps = std::iter::successors(Some(block), |&from| self.grid.neighbors(from)[direction]);
                for other in steps.skip(1).take(SURROUNDINGS) {
                    if self.inner_label(other) != label && self.fits[other].is_some() {
                        self.surroundings.push((label, other));
                    }
                }
            }
        }
        self.surroundings.sort_unstable();
        self.surroundings.dedup();
    }

    /// Measures the shape of each strip across its longest extent, from all its readings.
    fn measure_profiles(&mut self) {
        let profile =
            |(sums, is_wide): (&Moments, &bool)| if *is_wide { None } else { StripProfile::new(sums) };
        self.profiles.clear();
        self.profiles.push(None);
        self.profiles.extend(self.sums.iter().zip(&self.is_wide[1..]).map(profile));
        for block in 0..self.grid.len() {
            let whole = self.core_label(block);
            let labels = if whole > 0 { &[whole] } else { self.growing.meeting_in(block) };
            let merged = labels.iter().map(|&label| usize::from(self.relabelled[usize::from(label)]));
            if !merged.into_iter().any(|label| self.profiles[label].is_some()) {
                continue;
            }
            for v in self.grid.pixel_rows(block) {
                for u in self.grid.pixel_columns(block) {
                    let pixel = v * self.grid.width + u;
                    let own = self.relabelled[usize::from(self.extraction.labels[pixel])];
                    let label = if whole > 0 { whole } else { own };
                    let z = f64::from(self.depth[pixel]);
                    if let Some(profile) = &mut self.profiles[usize::from(label)]
                        && z > 0.0
                    {
                        profile.add([self.rays.x[u] * z, self.rays.y[v] * z, z]);
                    }
                }
            }
        }
    }

    /// Keeps the planes with enough support that are faces, largest first, and writes the final labels.
    fn write_planes(&mut self) {
        let mut order: Vec<u16> = (1..=self.sums.len() as u16).collect();
        let support = |label: u16| self.sums[usize::from(label) - 1].weight;
        order.retain(|&label| support(label) >= self.min_support());
        order.sort_by(|&a, &b| support(b).total_cmp(&support(a)).then(a.cmp(&b)));

        let mut ranks = vec![0_u16; self.sums.len() + 1];
        self.extraction.segments.clear();
        for label in order {
            let moments = self.sums[usize::from(label) - 1];
            let Some(fit) = moments.fit() else { continue };
            let noise = self.seeds[usize::from(label) - 1].noise_mse;
            let width = width(&moments);
            let is_strip = !self.is_wide[usize::from(label)];
            let is_part = self.is_round(label) || is_strip && self.is_step_or_goes_on(label);
            if is_part || self.tolerance.is_bent(width, noise, &fit) {
                continue;
            }
            self.extraction.segments.push(Segment { fit, support: moments.weight as usize, is_strip });
            ranks[usize::from(label)] = self.extraction.segments.len() as u16;
        }
        for label in &mut self.relabelled {
            *label = ranks[usize::from(*label)];
        }
        self.write_labels();
    }

    /// Whether a plane is part of something round. What lies around it may blur its own bend.
    fn is_round(&self, label: u16) -> bool {
        let bends = [&self.bends, &self.wider_bends].map(|bends| &bends[usize::from(label) - 1]);
        bends.into_iter().flatten().any(Bend::is_round)
    }

    /// Whether a strip lies across a step, or goes on beside its blocks, where a face would end at an edge.
    fn is_step_or_goes_on(&self, label: u16) -> bool {
        let place = usize::from(label) - 1;
        let goes_on = self.wider_bends[place]
            .as_ref()
            .zip(self.bends[place].as_ref())
            .is_some_and(|(wider, own)| wider.extends(own));
        goes_on || self.profiles[usize::from(label)].as_ref().is_some_and(StripProfile::is_step)
    }

    fn write_labels(&mut self) {
        let width = self.grid.width;
        for block in 0..self.grid.len() {
            let whole = self.growing.is_core(block);
            if !whole && self.growing.meeting_in(block).is_empty() {
                continue;
            }
            let columns = self.grid.pixel_columns(block);
            let own = self.relabelled[usize::from(self.block_labels[block])];
            for v in self.grid.pixel_rows(block) {
                let pixels = v * width + columns.start..v * width + columns.end;
                let labels = &mut self.extraction.labels[pixels.clone()];
                if whole {
                    label_readings(labels, &self.depth[pixels], own);
                } else {
                    for label in labels {
                        *label = self.relabelled[usize::from(*label)];
                    }
                }
            }
        }
    }
}

/// Gives all pixels that have a reading a label, eight at a time, and all others 0.
fn label_readings(labels: &mut [u16], depths: &[f32], own: u16) {
    const MANY: usize = 8;
    let label = |z: f32| if z > 0.0 { own } else { 0 };
    let ((labels, last_labels), (depths, last_depths)) =
        (labels.as_chunks_mut::<MANY>(), depths.as_chunks::<MANY>());
    for (labels, depths) in labels.iter_mut().zip(depths) {
        *labels = depths.map(label);
    }
    for (own, &z) in last_labels.iter_mut().zip(last_depths) {
        *own = label(z);
    }
}

fn sorted([a, b]: [u16; 2]) -> [u16; 2] {
    if a < b { [a, b] } else { [b, a] }
}
