use dymlm_core::vector3::{dot, unit};
use dymlm_core::{Plane, Pose, SensorModel};
use dymlm_geometry::{GridSample as Sample, SampleGrid as Window};

use super::ParameterizationConfig;
use super::flat_thing::LyingPlane;
use crate::{SupportPlane, SupportingPlanes};

/// The planes that things in a window may stand on.
#[derive(Debug, Default)]
pub(super) struct Ground {
    candidates: Vec<Candidate>,
    found: Vec<SupportPlane>,
    /// Heights of the samples outside the box.
    heights: Vec<f64>,
    /// Whether each sample lies on one of the candidates.
    is_marked: Vec<bool>,
}

#[derive(Debug, Clone, Copy)]
struct Candidate {
    support: SupportPlane,
    /// In the camera frame.
    plane: Plane,
    samples: u32,
    outside: u32,
}

impl Candidate {
    fn new(support: SupportPlane, plane: Plane) -> Self {
        Self { support, plane, samples: 0, outside: 0 }
    }
}

/// Standard deviations of the depth noise that are added to a plane's tolerance: no more, as samples are
/// means of 9 readings or more.
const PLANE_SIGMAS: f64 = 1.0;
/// Samples at which planes are asked for, along each side of the window.
const PROBES: usize = 5;
/// How far from a probe a plane may be, metres.
const REACH: f64 = 0.05;
/// Half width of the band of heights that a level patch's samples lie in, metres.
const LEVEL_BAND: f64 = 0.008;
/// Share of the samples outside the box, and their number, that make a level patch.
const LEVEL_SHARE: f64 = 0.15;
const LEAST_LEVEL: f64 = 12.0;
/// Level patches around a box, at most.
const MAX_PATCHES: usize = 2;
/// Least share of a plane's samples that must lie outside the box: its own upper side does not carry a thing.
const LEAST_OUTSIDE: f64 = 0.08;
impl Ground {
    /// Finds the upright planes of the map in a window that go on outside its box, and the samples on them.
    pub(super) fn find(
        &mut self,
        window: &Window,
        planes: &dyn SupportingPlanes,
        world_from_camera: &Pose,
        config: &ParameterizationConfig,
        sensor: &SensorModel,
    ) {
        self.ask(window, planes, world_from_camera, config);
        self.count(window, config, sensor);
        self.mark(window, config, sensor);
    }

    /// Adds level patches around the box that are no planes of the map: a table of which too little is seen.
    /// Answers how many.
    pub(super) fn find_level_patches(
        &mut self,
        window: &Window,
        vertical: [f64; 3],
        world_from_camera: &Pose,
        config: &ParameterizationConfig,
        sensor: &SensorModel,
    ) -> usize {
        let known = self.candidates.len();
        self.add_level_patches(window, vertical, world_from_camera);
        self.count(window, config, sensor);
        self.mark(window, config, sensor);
        self.candidates.len().saturating_sub(known)
    }

    fn ask(
        &mut self,
        window: &Window,
        planes: &dyn SupportingPlanes,
        world_from_camera: &Pose,
        config: &ParameterizationConfig,
    ) {
        self.found.clear();
        let step = (window.columns.min(window.rows) / PROBES).max(1);
        let probes = window.samples.iter().filter(|sample| {
            let at = |index: u32| (index as usize) % step == step / 2;
            at(sample.column) && at(sample.row)
        });
        for probe in probes {
            let point = world_from_camera.transform_point(probe.point.map(f64::from));
            planes.near(point, REACH, &mut self.found);
        }
        self.found.sort_unstable_by_key(|found| found.id);
        self.found.dedup_by_key(|found| found.id);
        let up = world_from_camera.rotate([0.0, -1.0, 0.0]);
        let least_cosine = config.max_support_tilt.cos();
        let camera_from_world = world_from_camera.inverse();
        self.candidates.clear();
        let upright = self.found.iter().filter(|found| dot(found.plane.normal(), up) >= least_cosine);
        self.candidates.extend(
            upright.map(|&support| Candidate::new(support, support.plane.transformed(&camera_from_world))),
        );
    }

    /// Adds the heights at which many of the samples outside the box lie, where no plane of the map is.
    fn add_level_patches(&mut self, window: &Window, vertical: [f64; 3], world_from_camera: &Pose) {
        let up = world_from_camera.inverse().rotate(vertical);
        self.heights.clear();
        let outside = window.samples.iter().filter(|sample| !sample.is_in_box);
        self.heights.extend(outside.map(|sample| dot(up, sample.point.map(f64::from))));
        self.heights.sort_unstable_by(f64::total_cmp);
        let least = (LEVEL_SHARE * self.heights.len() as f64).max(LEAST_LEVEL);
        for _ in 0..MAX_PATCHES {
            let Some(height) = densest(&self.heights, least) else { return };
            self.heights.retain(|own| (own - height).abs() > 3.0 * LEVEL_BAND);
            let Ok(plane) = Plane::new(up, -height) else { return };
            let is_known = self.candidates.iter().any(|candidate| {
                let middle = up.map(|c| c * height);
                dot(candidate.plane.normal(), up) > 0.99
                    && candidate.plane.signed_distance(middle).abs() < 0.03
            });
            if !is_known {
                let support = SupportPlane::local(plane.transformed(world_from_camera));
                self.candidates.push(Candidate::new(support, plane));
            }
        }
    }

    fn count(&mut self, window: &Window, config: &ParameterizationConfig, sensor: &SensorModel) {
        for candidate in &mut self.candidates {
            let own = *candidate;
            let on_it = window.samples.iter().filter(|sample| is_on(&own, sample, config, sensor));
            let (samples, outside) = on_it.fold((0, 0), |(samples, outside), sample| {
                (samples + 1, outside + u32::from(!sample.is_in_box))
            });
            (candidate.samples, candidate.outside) = (samples, outside);
        }
        self.candidates.retain(|candidate| {
            f64::from(candidate.outside) > LEAST_OUTSIDE * f64::from(candidate.samples)
                && candidate.samples >= 4
        });
    }

    fn mark(&mut self, window: &Window, config: &ParameterizationConfig, sensor: &SensorModel) {
        let candidates = &self.candidates;
        self.is_marked.clear();
        let is_ground = |sample| candidates.iter().any(|candidate| is_on(candidate, sample, config, sensor));
        self.is_marked.extend(window.samples.iter().map(is_ground));
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
            .reduce(|most, next| if in_box(next) > in_box(most) { next } else { most })?;
        Some(LyingPlane { support: most.support, plane: most.plane })
    }

    /// The highest plane that the samples stand on: nearly all of them are above it, the lowest no farther
    /// than `max_gap` metres.
    pub(super) fn under<'a>(
        &self,
        samples: &(impl Iterator<Item = &'a Sample> + Clone),
        max_gap: f64,
        heights: &mut Vec<f64>,
        config: &ParameterizationConfig,
        sensor: &SensorModel,
    ) -> Option<SupportPlane> {
        let mut nearest: Option<(f64, SupportPlane)> = None;
        for candidate in &self.candidates {
            heights.clear();
            heights.extend(samples.clone().map(|sample| {
                let height = candidate.plane.signed_distance(sample.point.map(f64::from));
                height + tolerance(candidate, sample, config, sensor)
            }));
            let below = heights.iter().filter(|&&height| height < 0.0).count();
            if heights.is_empty() || below as f64 > 0.1 * heights.len() as f64 {
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

/// The middle of the narrow band that holds most of some ascending heights; `None` when it holds fewer than
/// `least`.
fn densest(heights: &[f64], least: f64) -> Option<f64> {
    let mut best = None;
    let (mut low, mut most) = (0, 0);
    for (high, height) in heights.iter().enumerate() {
        while height - heights[low] > 2.0 * LEVEL_BAND {
            low += 1;
        }
        let count = high + 1 - low;
        if count > most {
            (most, best) = (count, heights.get(usize::midpoint(low, high)).copied());
        }
    }
    best.filter(|_| most as f64 >= least)
}

/// What is below a plane lies on it as little as what is above: the table under a keyboard's upper side.
fn is_on(
    candidate: &Candidate,
    sample: &Sample,
    config: &ParameterizationConfig,
    sensor: &SensorModel,
) -> bool {
    let distance = candidate.plane.signed_distance(sample.point.map(f64::from));
    distance.abs() <= tolerance(candidate, sample, config, sensor)
}

/// How far from a plane a sample counts as its, metres: the noise is along the ray.
fn tolerance(
    candidate: &Candidate,
    sample: &Sample,
    config: &ParameterizationConfig,
    sensor: &SensorModel,
) -> f64 {
    let ray = unit(sample.point.map(f64::from)).unwrap_or([0.0, 0.0, 1.0]);
    let steepness = dot(candidate.plane.normal(), ray).abs();
    config.plane_tolerance + PLANE_SIGMAS * f64::from(sensor.sigma(sample.point[2])) * steepness
}
