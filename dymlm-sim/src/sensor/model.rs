use dymlm_core::PinholeCamera;
use rand::{Rng, RngExt};
#[cfg(feature = "parallel")]
use rayon::prelude::*;

use super::SensorConfig;
use crate::noise::{NormalTable, Use, stream};
use crate::render::Rendering;
use crate::scene::Part;

/// A depth camera: turns exact depth into readings.
///
/// The errors: the projector's shadow; readings lost or mixed at depth edges; jitter of the point that a
/// pixel looks at; surfaces that send nothing back; axial noise; disparity steps; range. Models: Nguyen,
/// Izadi, Lovell (3DIMPVT 2012) for axial and lateral noise; Khoshelham, Elberink (Sensors 2012) for
/// quantization; lateral jitter before axial noise as in Handa et al. (ICRA 2014). O(pixels).
#[derive(Debug, Clone)]
pub(crate) struct Sensor {
    config: SensorConfig,
    seed: u64,
    normals: NormalTable,
    /// Cosine of an angle of incidence a little below that at which readings begin to get lost.
    steep: f32,
}

/// Steps of a disparity finer than this, as [`SensorConfig::quantization`] has them, are none: at 1 m they
/// are a tenth of a micrometre, and much finer ones cannot be counted.
const FINEST_QUANTIZATION: f64 = 1e-7;

/// What a frame shows: exact depth, what each pixel looks at, and the share of readings that are lost on each
/// part.
#[derive(Debug, Clone, Copy)]
struct Seen<'a> {
    exact: &'a Rendering,
    places: &'a [Place],
    lost: &'a [f64],
}

/// What each pixel looks at, row by row.
#[derive(Debug, Clone, Default)]
pub(crate) struct Places(Vec<Place>);

/// What a pixel looks at.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Place {
    Surface,
    /// Near a depth edge.
    Edge,
    /// Not lit by the projector.
    Shadow,
}

/// A depth step of more than 3 cm + 4 % of the depth is an edge, as in plane extraction (Feng 2014).
fn is_edge(z: f32, other: f32) -> bool {
    (z - other).abs() > 0.03 + 0.04 * z.min(other)
}

impl Sensor {
    pub(crate) fn new(config: SensorConfig, seed: u64) -> Self {
        let steep = config.grazing_start.cos() as f32 + 1e-3;
        Self { config, seed, normals: NormalTable::new(), steep }
    }

    /// Puts the readings of frame `index` into `readings`, row by row; 0 = none.
    pub(crate) fn sense(
        &self,
        camera: &PinholeCamera,
        exact: &Rendering,
        parts: &[Part],
        index: usize,
        places: &mut Places,
        readings: &mut Vec<f32>,
    ) {
        self.find_places(camera, exact, &mut places.0);
        readings.clear();
        readings.resize(exact.depth.len(), 0.0);
        let lost: Vec<f64> = parts.iter().map(|part| self.lost(part)).collect();
        let seen = Seen { exact, places: &places.0, lost: &lost };
        let sense_row = |(v, row): (usize, &mut [f32])| self.sense_row(row, v, &seen, index);
        #[cfg(feature = "parallel")]
        readings.par_chunks_mut(exact.width).enumerate().for_each(sense_row);
        #[cfg(not(feature = "parallel"))]
        readings.chunks_mut(exact.width).enumerate().for_each(sense_row);
    }

    fn find_places(&self, camera: &PinholeCamera, exact: &Rendering, places: &mut Vec<Place>) {
        let reach = self.reach(exact.width);
        places.clear();
        places.resize(exact.depth.len(), Place::Surface);
        if reach > 0 {
            mark_edges(places, exact, reach);
        }
        if self.config.baseline != 0.0 {
            let disparity_at_1m = (camera.fx() * self.config.baseline) as f32;
            for (places, depths) in places.chunks_mut(exact.width).zip(exact.depth.chunks(exact.width)) {
                mark_shadow(places, depths, disparity_at_1m);
            }
        }
    }

    /// Distance from an edge, in pixels of this image, within which readings are disturbed.
    fn reach(&self, width: usize) -> usize {
        (self.config.edge_width * width as f64 / 640.0).round() as usize
    }

    fn sense_row(&self, row: &mut [f32], v: usize, seen: &Seen<'_>, index: usize) {
        let exact = seen.exact;
        let mut rng = stream(self.seed, Use::Sensor, index as u64, v as u64);
        let lateral = (self.config.lateral_noise * exact.width as f64 / 640.0) as f32;
        let reach = self.reach(exact.width);
        for (u, reading) in row.iter_mut().enumerate() {
            let bits = rng.next_u64();
            let source_u = jittered(u, lateral * self.normals.normal(bits), exact.width);
            let source_v = jittered(v, lateral * self.normals.normal(bits >> 12), exact.height);
            let source = source_v * exact.width + source_u;
            let z = match seen.places[source] {
                Place::Shadow => continue,
                Place::Edge => self.at_edge(exact, [source_u, source_v], reach, &mut rng),
                Place::Surface => exact.depth[source],
            };
            if z > 0.0 {
                let incidence = exact.incidence[source];
                let lost = self.lost_at(incidence, seen.lost_of(exact.part[source]));
                if lost <= 0.0 || rng.random_range(0.0..1.0) >= lost {
                    *reading = z + self.axial_noise(z, incidence) * self.normals.normal(bits >> 24);
                }
            }
        }
        self.quantize(row);
        self.limit(row);
    }

    /// A reading near an edge: lost (0), mixed from the surfaces on both sides, or exact.
    fn at_edge(&self, exact: &Rendering, [u, v]: [usize; 2], reach: usize, rng: &mut impl Rng) -> f32 {
        let fate = rng.random_range(0.0..1.0);
        let z = exact.depth[v * exact.width + u];
        if fate < self.config.edge_dropout {
            0.0
        } else if fate < self.config.edge_dropout + self.config.flying_pixels {
            let other = neighbours(exact, u, v, reach)
                .map(|pixel| exact.depth[pixel])
                .filter(|&other| other > 0.0 && is_edge(z, other))
                .last()
                .unwrap_or(z);
            z + rng.random_range(0.0..1.0_f32) * (other - z)
        } else {
            z
        }
    }

    /// Share of the readings of a part that get lost at any angle of incidence.
    fn lost(&self, part: &Part) -> f64 {
        self.config.dropout.max(f64::from(part.material.absorption) * self.config.absorption)
    }

    /// Share of the readings that get lost at an angle of incidence, given by its cosine: steep surfaces send
    /// little light back.
    fn lost_at(&self, incidence: f32, lost: f64) -> f64 {
        // Only the few steep pixels need the angle itself.
        if incidence > self.steep {
            return lost;
        }
        let angle = f64::from(incidence).acos();
        let ramp = (self.config.grazing_end - self.config.grazing_start).max(1e-9);
        lost.max(((angle - self.config.grazing_start) / ramp).clamp(0.0, 1.0))
    }

    /// Standard deviation along the optical axis at depth z (Nguyen 2012, eq. 4).
    fn axial_noise(&self, z: f32, incidence: f32) -> f32 {
        let mut sigma = self.config.noise.sigma(z);
        if incidence < 0.6 {
            let angle = incidence.acos();
            // The fit is valid up to 80 degrees.
            let rest = (std::f32::consts::FRAC_PI_2 - angle).max(0.17);
            sigma += self.config.steep_noise as f32 * (0.0001 / z.sqrt() * (angle / rest) * (angle / rest));
        }
        sigma
    }

    /// Rounds each depth to one whose disparity is a whole number of steps.
    fn quantize(&self, row: &mut [f32]) {
        // Steps too fine to be counted change nothing.
        if self.config.quantization < FINEST_QUANTIZATION {
            return;
        }
        let steps_at_1m = 1.0 / self.config.quantization as f32;
        for z in row {
            // Without a reading the quotient is infinite or negative, and the next line does not use it.
            let disparity = (steps_at_1m / *z + 0.5) as i32 as f32;
            *z = if *z > 0.0 && disparity >= 1.0 { steps_at_1m / disparity } else { 0.0 };
        }
    }

    fn limit(&self, row: &mut [f32]) {
        let (min, max) = (self.config.min_depth as f32, self.config.max_depth as f32);
        for z in row {
            *z = if (min..=max).contains(z) { *z } else { 0.0 };
        }
    }
}

impl Seen<'_> {
    fn lost_of(&self, part: u16) -> f64 {
        self.lost.get(usize::from(part)).copied().unwrap_or(0.0)
    }
}

fn jittered(coordinate: usize, offset: f32, count: usize) -> usize {
    // Rounds to the nearest whole pixel, halves away from zero: truncation is inlined, while `f32::round` is
    // a call.
    let whole = (offset + 0.5_f32.copysign(offset)) as i64;
    (coordinate as i64 + whole).clamp(0, count as i64 - 1) as usize
}

/// The pixels of the same row and column within `reach`, nearest last.
fn neighbours(exact: &Rendering, u: usize, v: usize, reach: usize) -> impl Iterator<Item = usize> {
    let (width, height) = (exact.width, exact.height);
    (1..=reach).rev().flat_map(move |k| {
        let left = (u >= k).then(|| v * width + u - k);
        let right = (u + k < width).then_some(v * width + u + k);
        let above = (v >= k).then(|| (v - k) * width + u);
        let below = (v + k < height).then_some((v + k) * width + u);
        [left, right, above, below].into_iter().flatten()
    })
}

/// Marks all pixels within `reach` of a depth step, on both sides, along rows and columns.
fn mark_edges(places: &mut [Place], exact: &Rendering, reach: usize) {
    let (width, height) = (exact.width, exact.height);
    for v in 0..height {
        for u in 0..width {
            let pixel = v * width + u;
            let z = exact.depth[pixel];
            if u + 1 < width && is_edge(z, exact.depth[pixel + 1]) {
                let (first, end) = ((u + 1).saturating_sub(reach), (u + 1 + reach).min(width));
                places[v * width + first..v * width + end].fill(Place::Edge);
            }
            if v + 1 < height && is_edge(z, exact.depth[pixel + width]) {
                for row in (v + 1).saturating_sub(reach)..(v + 1 + reach).min(height) {
                    places[row * width + u] = Place::Edge;
                }
            }
        }
    }
}

/// Marks what the projector, beside the camera on its x axis, does not light. The projector sees the pixel at
/// u in its own column u - disparity. Pixels are visited from the projector's side; one whose column was
/// already passed is occluded from the projector.
fn mark_shadow(places: &mut [Place], depths: &[f32], disparity_at_1m: f32) {
    let mut passed = f32::INFINITY;
    let mut visit = |u: usize, toward: f32| {
        let z = depths[u];
        if z <= 0.0 {
            return;
        }
        let column = toward * (u as f32 - disparity_at_1m / z);
        // On steep surfaces the column hardly changes from pixel to pixel; half a pixel of slack keeps
        // rounding from shadowing them.
        if column > passed + 0.5 {
            places[u] = Place::Shadow;
        }
        passed = passed.min(column);
    };
    if disparity_at_1m > 0.0 {
        (0..depths.len()).rev().for_each(|u| visit(u, 1.0));
    } else {
        (0..depths.len()).for_each(|u| visit(u, -1.0));
    }
}
