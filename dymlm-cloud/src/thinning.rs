use crate::CloudMapConfig;
use crate::block_store::{BLOCK_SIDE, CellBits, cell_in_block};
use crate::places::Places;
use crate::weighting::Weighting;

/// Farthest distance at which a voxel looks for heavier ones, voxels: not beyond the blocks around its own.
const MAX_RADIUS: usize = BLOCK_SIDE;

/// A voxel with less than this share of the weight of another within its radius is noise: at 1.4 standard
/// deviations from a surface there is this share of the readings. A lower value leaves a thicker shell of
/// noise, a higher one takes true surfaces away
/// (`a_far_noisy_surface_is_thinned_and_keeps_no_hole_whatever_the_sensor`).
const MIN_WEIGHT_SHARE: f32 = 0.4;

/// Finds the voxels that hold only the noise of a surface beside them.
///
/// Readings of a surface scatter along the line of sight by sigma(z), at 4 m over many voxels: the true
/// surface is where most weight lies, and a shell of light voxels surrounds it. A voxel is noise when another
/// static voxel within [`thinning_radius`](CloudMapConfig::thinning_radius) standard deviations has more than
/// 1 / [`MIN_WEIGHT_SHARE`] times its weight. The deviation is that of the voxel's own readings: a voxel that
/// was seen from near is exact, does not even reach the next voxel, and is left alone; and two surfaces stay
/// two as long as they are further apart than that.
#[derive(Debug, Clone)]
pub(crate) struct Thinning {
    min_observations: u32,
    /// Radius in standard deviations of a voxel's readings.
    radius: f64,
    voxel_size: f64,
    weighting: Weighting,
    /// Factor from a weight to [`Weighting::total`]; a power of two.
    inverse_unit: f32,
    /// For each radius of a window, from 1 on, the offsets in it by ascending distance.
    balls: Vec<Vec<Offset>>,
}

/// The way from a cell to another around it.
#[derive(Debug, Clone, Copy)]
struct Offset {
    /// Square of the distance, voxels.
    squared_distance: f32,
    /// Step in the weights of the window.
    step: isize,
}

/// A voxel that may be noise.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Candidate {
    pub(crate) place: usize,
    /// The candidate is noise when a voxel that weighs more than this ...
    pub(crate) limit: f32,
    /// ... lies within this radius, voxels.
    pub(crate) radius: f32,
}

/// The weights of the static voxels in and around a block; 0 elsewhere.
#[derive(Debug, Default)]
pub(crate) struct Window {
    /// How far it reaches beyond the block, voxels.
    radius: usize,
    /// The least limit of the candidates.
    least_limit: f32,
    weights: Vec<f32>,
}

impl Thinning {
    pub(crate) fn new(config: &CloudMapConfig, weighting: Weighting) -> Self {
        Self {
            min_observations: config.min_observations,
            radius: config.thinning_radius,
            voxel_size: config.voxel_size,
            weighting,
            inverse_unit: weighting.total(1) as f32,
            balls: (1..=MAX_RADIUS).map(ball).collect(),
        }
    }

    /// Weight of a static voxel when it is compared with others; more than 0.
    #[inline]
    pub(crate) fn weight(&self, weight: u64) -> f32 {
        weight as i64 as f32 * self.inverse_unit
    }

    /// Whether enough frames have read a voxel.
    pub(crate) fn is_seen(&self, observations: u32) -> bool {
        observations >= self.min_observations
    }

    /// Distance within which a voxel looks for heavier ones, voxels.
    pub(crate) fn radius(&self, weight: u64, observations: u32) -> f32 {
        ((self.radius * self.deviation(weight, observations)) as f32).min(MAX_RADIUS as f32)
    }

    /// Sum over `observations` readings of their weight times their variance, square voxels.
    pub(crate) fn noise(&self, observations: u64) -> f64 {
        observations as f64 * self.weighting.least_variance() / (self.voxel_size * self.voxel_size)
    }

    /// Standard deviation of a voxel's readings along the line of sight, voxels.
    pub(crate) fn deviation(&self, weight: u64, observations: u32) -> f64 {
        self.weighting.standard_deviation(weight, observations) / self.voxel_size
    }

    /// Whether a voxel in the window makes the candidate noise; `heaviest`: the greatest weight in the
    /// window.
    pub(crate) fn is_noise(&self, window: &Window, candidate: &Candidate, heaviest: f32) -> bool {
        if candidate.limit >= heaviest {
            return false;
        }
        let [x, y, z] = cell_in_block(candidate.place).map(|c| c as usize + window.radius);
        let center = (z * window.side() + y) * window.side() + x;
        let ball = window.radius.checked_sub(1).and_then(|index| self.balls.get(index));
        let reach = candidate.radius * candidate.radius;
        let within = ball.into_iter().flatten().take_while(|offset| offset.squared_distance <= reach);
        within
            .map(|offset| window.weights[center.wrapping_add_signed(offset.step)])
            .any(|weight| weight > candidate.limit)
    }
}

/// Whether a voxel with this radius looks beyond its own place.
pub(crate) fn looks_around(radius: f32) -> bool {
    radius >= 1.0
}

/// The weight beyond which another voxel makes a voxel of this weight noise.
pub(crate) fn limit(weight: f32) -> f32 {
    weight / MIN_WEIGHT_SHARE
}

impl Window {
    /// Empties the window, and makes it wide enough for all candidates.
    pub(crate) fn reset(&mut self, candidates: &[Candidate]) {
        let radius = candidates.iter().map(|candidate| candidate.radius).fold(1.0, f32::max);
        self.radius = radius as usize;
        self.least_limit = candidates.iter().map(|candidate| candidate.limit).fold(f32::INFINITY, f32::min);
        self.weights.clear();
        self.weights.resize(self.side().pow(3), 0.0);
    }

    /// Weights up to this concern no candidate.
    pub(crate) fn least_limit(&self) -> f32 {
        self.least_limit
    }

    /// Puts in the weights, by rank, of some of a block's voxels; `step` leads from the middle block to this
    /// one.
    pub(crate) fn fill(
        &mut self,
        step: [i32; 3],
        places: &Places,
        voxels: &CellBits,
        weight: impl Fn(usize) -> f32,
    ) {
        let [xs, ys, zs] = step.map(|step| match step {
            -1 => BLOCK_SIDE - self.radius..BLOCK_SIDE,
            0 => 0..BLOCK_SIDE,
            _ => 0..self.radius,
        });
        let first = step.map(|step| self.radius.wrapping_add_signed(step as isize * BLOCK_SIDE as isize));
        let side = self.side();
        let origin =
            first[2].wrapping_mul(side).wrapping_add(first[1]).wrapping_mul(side).wrapping_add(first[0]);
        let columns = (0xFF_u64 >> (BLOCK_SIDE - xs.len()) << xs.start) * 0x0101_0101_0101_0101;
        let rows = u64::MAX >> (BLOCK_SIDE * (BLOCK_SIDE - ys.len())) << (BLOCK_SIDE * ys.start);
        let inside = columns & rows;
        places.for_each_in(
            zs,
            |z| voxels[z] & inside,
            |place, rank| {
                let [x, y, z] = cell_in_block(place).map(|c| c as usize);
                let cell = origin.wrapping_add((z * side + y) * side + x);
                if let Some(entry) = self.weights.get_mut(cell) {
                    *entry = weight(rank);
                }
            },
        );
    }

    fn side(&self) -> usize {
        BLOCK_SIDE + 2 * self.radius
    }
}

/// Offsets to the cells of a ball in a window of its radius, nearest first, without the centre.
fn ball(radius: usize) -> Vec<Offset> {
    let (side, radius) = ((BLOCK_SIDE + 2 * radius) as isize, radius as isize);
    let mut offsets = Vec::new();
    for z in -radius..=radius {
        for y in -radius..=radius {
            for x in -radius..=radius {
                let squared = x * x + y * y + z * z;
                // Radii are no whole numbers: cells beyond `radius`, but within the next whole one, may be
                // reached.
                if (1..(radius + 1) * (radius + 1)).contains(&squared) {
                    let step = (z * side + y) * side + x;
                    offsets.push(Offset { squared_distance: squared as f32, step });
                }
            }
        }
    }
    offsets.sort_by(|a, b| a.squared_distance.total_cmp(&b.squared_distance));
    offsets
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_balls_are_whole_and_nearest_first() {
        for radius in 1..=MAX_RADIUS {
            let ball = ball(radius);
            let within =
                |squared: f32| ball.iter().filter(|offset| offset.squared_distance <= squared).count();
            assert_eq!((within(1.0), within(3.0)), (6, 26));
            assert!(ball.is_sorted_by(|a, b| a.squared_distance <= b.squared_distance));
            // Point symmetric, so the steps cancel.
            assert_eq!(ball.iter().map(|offset| offset.step).sum::<isize>(), 0);
        }
    }
}
