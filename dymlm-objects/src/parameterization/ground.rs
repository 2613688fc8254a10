use dymlm_core::vector3::{dot, unit};
use dymlm_core::{Plane, Pose, SensorModel};
use dymlm_geometry::{GridSample as Sample, SampleGrid as Window};

use super::ParameterizationConfig;
use super::flat_thing::LyingPlane;
use crate::support::drop_repeated;
use crate::{SupportPlane, SupportingPlanes};

/// The planes that things in a window may stand on.
#[derive(Debug, Clone)]
pub(super) struct Ground {
    sensor: SensorModel,
    /// Distance up to which points belong to a plane, metres; a reading's noise is added.
    plane_tolerance: f64,
    /// Largest distance of a thing from the plane on which it stands, metres.
    max_gap: f64,
    /// Least cosine between a level plane's normal and the vertical.
    least_cosine: f64,
    candidates: Vec<Candidate>,
    found: Vec<SupportPlane>,
    /// Heights of samples outside the box.
    heights: Vec<f64>,
    /// Whether each sample lies on one of the candidates.
    is_marked: Vec<bool>,
}

#[derive(Debug, Clone, Copy)]
struct Candidate {
    support: SupportPlane,
    /// In the camera frame.
    plane: Plane,
    /// Whether things may stand on it: it is level, or the vertical is not known.
    is_level: bool,
    samples: u32,
    outside: u32,
}

impl Candidate {
    fn new(support: SupportPlane, plane: Plane, is_level: bool) -> Self {
        Self { support, plane, is_level, samples: 0, outside: 0 }
    }
}

/// Number of samples along each side of the window at which planes are looked up.
const PROBES: usize = 5;
/// Half width of the band of heights within which a level patch's samples lie, metres.
const LEVEL_BAND: f64 = 0.008;
/// Least share of the samples outside the box, and their least number, that make a level patch.
const LEVEL_SHARE: f64 = 0.15;
const LEAST_LEVEL: f64 = 12.0;
/// Most level patches around a box.
const MAX_PATCHES: usize = 2;
/// Least share of a plane's samples that must lie outside the box: a thing does not stand on its own upper
/// side.
const LEAST_OUTSIDE: f64 = 0.08;

impl Ground {
    pub(super) fn new(config: &ParameterizationConfig, sensor: SensorModel) -> Self {
        Self {
            sensor,
            plane_tolerance: config.plane_tolerance,
            max_gap: config.max_support_gap,
            least_cosine: config.max_support_slope.cos(),
            candidates: Vec::new(),
            found: Vec::new(),
            heights: Vec::new(),
            is_marked: Vec::new(),
        }
    }

    /// Finds the planes of the map in a window that continue outside its box, level or not, and the samples
    /// on them, which are not part of a thing.
    pub(super) fn find(
        &mut self,
        window: &Window,
        planes: &dyn SupportingPlanes,
        vertical: Option<[f64; 3]>,
        world_from_camera: &Pose,
    ) {
        self.find_candidates(window, planes, vertical, world_from_camera);
        self.count_and_mark(window);
    }

    /// Adds level patches around the box that are not planes of the map, such as a table of which too little
    /// is seen. Returns how many were added.
    pub(super) fn find_level_patches(
        &mut self,
        window: &Window,
        vertical: [f64; 3],
        world_from_camera: &Pose,
    ) -> usize {
        let known = self.candidates.len();
        self.add_level_patches(window, vertical, world_from_camera);
        self.count_and_mark(window);
        self.candidates.len().saturating_sub(known)
    }

    fn find_candidates(
        &mut self,
        window: &Window,
        planes: &dyn SupportingPlanes,
        vertical: Option<[f64; 3]>,
        world_from_camera: &Pose,
    ) {
        self.found.clear();
        let step = (window.columns.min(window.rows) / PROBES).max(1);
        let probes = window.samples.iter().filter(|sample| {
            let at = |index: u32| (index as usize) % step == step / 2;
            at(sample.column) && at(sample.row)
        });
        for probe in probes {
            let point = world_from_camera.transform_point(probe.point.map(f64::from));
            planes.near(point, self.max_gap, &mut self.found);
        }
        drop_repeated(&mut self.found);
        let camera_from_world = world_from_camera.inverse();
        self.candidates.clear();
        self.candidates.extend(self.found.iter().map(|&support| {
            let normal = support.plane.normal();
            let is_level = vertical.is_none_or(|vertical| dot(normal, vertical) >= self.least_cosine);
            Candidate::new(support, support.plane.transformed(&camera_from_world), is_level)
        }));
    }

    /// Adds a level patch at each height at which many of the samples outside the box lie and the map has no
    /// plane.
    fn add_level_patches(&mut self, window: &Window, vertical: [f64; 3], world_from_camera: &Pose) {
        let up = world_from_camera.inverse().rotate(vertical);
        self.heights.clear();
        let outside = window.samples.iter().filter(|sample| !sample.is_in_box);
        self.heights.extend(outside.map(|sample| dot(up, sample.point.map(f64::from))));
        self.heights.sort_unstable_by(f64::total_cmp);
        let least = (LEVEL_SHARE * self.heights.len() as f64).max(LEAST_LEVEL);
        for _ in 0..MAX_PATCHES {
            let Some(height) = densest(&self.heights, LEVEL_BAND, least) else { return };
            self.heights.retain(|own| (own - height).abs() > 3.0 * LEVEL_BAND);
            let Ok(plane) = Plane::new(up, -height) else { return };
            let is_known = self.candidates.iter().any(|candidate| {
                let middle = up.map(|c| c * height);
                dot(candidate.plane.normal(), up) > 0.99
                    && candidate.plane.signed_distance(middle).abs() < 0.03
            });
            if !is_known {
                let support = SupportPlane::local(plane.transformed(world_from_camera));
                self.candidates.push(Candidate::new(support, plane, true));
            }
        }
    }

    /// Keeps the candidates that continue outside the box, and marks the samples on them.
    fn count_and_mark(&mut self, window: &Window) {
        let mut candidates = std::mem::take(&mut self.candidates);
        for candidate in &mut candidates {
            let plane = candidate.plane;
            let on_it = window.samples.iter().filter(|sample| self.is_on(&plane, sample));
            (candidate.samples, candidate.outside) = on_it.fold((0, 0), |(samples, outside), sample| {
                (samples + 1, outside + u32::from(!sample.is_in_box))
            });
        }
        candidates.retain(|own| f64::from(own.outside) > LEAST_OUTSIDE * f64::from(own.samples));
        let is_ground = |sample| candidates.iter().any(|candidate| self.is_on(&candidate.plane, sample));
        let is_marked = window.samples.iter().map(is_ground).collect();
        (self.candidates, self.is_marked) = (candidates, is_marked);
    }

    /// Whether a sample lies on a plane. A sample below the plane does not, such as the table below the plane
    /// of a keyboard's upper side.
    fn is_on(&self, plane: &Plane, sample: &Sample) -> bool {
        plane.signed_distance(sample.point.map(f64::from)).abs() <= self.tolerance(plane, sample)
    }

    /// Distance up to which a sample belongs to a plane, metres. The noise acts along the ray; one standard
    /// deviation of it is enough, because samples are means of 9 readings or more.
    fn tolerance(&self, plane: &Plane, sample: &Sample) -> f64 {
        let ray = unit(sample.point.map(f64::from)).unwrap_or([0.0, 0.0, 1.0]);
        let steepness = dot(plane.normal(), ray).abs();
        self.plane_tolerance + f64::from(self.sensor.sigma(sample.point[2])) * steepness
    }

    /// Whether each sample lies on a supporting plane.
    pub(super) fn is_ground(&self) -> &[bool] {
        &self.is_marked
    }

    /// The plane on which most of the samples in the box lie.
    pub(super) fn flattest(&self) -> Option<LyingPlane> {
        let in_box = |candidate: &Candidate| candidate.samples - candidate.outside;
        let most = self
            .candidates
            .iter()
            .filter(|candidate| candidate.is_level)
            .reduce(|most, next| if in_box(next) > in_box(most) { next } else { most })?;
        Some(LyingPlane { support: most.support, plane: most.plane })
    }

    /// The highest plane on which the samples stand: nearly all of them are above it, and the lowest ones at
    /// most `max_gap` metres.
    pub(super) fn under<'a>(
        &self,
        samples: &(impl Iterator<Item = &'a Sample> + Clone),
        max_gap: f64,
    ) -> Option<SupportPlane> {
        self.nearest(|candidate| candidate.is_level, samples, max_gap)
    }

    /// The normal, in the world, of the plane on which the samples rest or against which they lean, level or
    /// not.
    pub(super) fn resting_normal<'a>(
        &self,
        samples: &(impl Iterator<Item = &'a Sample> + Clone),
    ) -> Option<[f64; 3]> {
        self.nearest(|_| true, samples, self.max_gap).map(|support| support.plane.normal())
    }

    fn nearest<'a>(
        &self,
        may_be: impl Fn(&&Candidate) -> bool,
        samples: &(impl Iterator<Item = &'a Sample> + Clone),
        max_gap: f64,
    ) -> Option<SupportPlane> {
        let mut nearest: Option<(f64, SupportPlane)> = None;
        let mut heights: Vec<f64> = Vec::new();
        for candidate in self.candidates.iter().filter(may_be) {
            let height = |sample: &Sample| {
                let height = candidate.plane.signed_distance(sample.point.map(f64::from));
                height + self.tolerance(&candidate.plane, sample)
            };
            heights.clear();
            heights.extend(samples.clone().map(height));
            let below = heights.iter().filter(|&&height| height < 0.0).count();
            if heights.is_empty() || 10 * below > heights.len() {
                continue;
            }
            let rank = heights.len() / 20;
            let gap = *heights.select_nth_unstable_by(rank, f64::total_cmp).1;
            if gap <= max_gap && nearest.is_none_or(|(least, _)| gap < least) {
                nearest = Some((gap, candidate.support));
            }
        }
        nearest.map(|(_, support)| support)
    }
}

/// The middle of the band of width 2 * `half_width` that holds most of the ascending `heights`; `None` when
/// it holds fewer than `least`.
fn densest(heights: &[f64], half_width: f64, least: f64) -> Option<f64> {
    let mut best = None;
    let (mut low, mut most) = (0, 0);
    for (high, height) in heights.iter().enumerate() {
        while height - heights[low] > 2.0 * half_width {
            low += 1;
        }
        let count = high + 1 - low;
        if count > most {
            (most, best) = (count, heights.get(usize::midpoint(low, high)).copied());
        }
    }
    best.filter(|_| most as f64 >= least)
}
