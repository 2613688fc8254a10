use crate::CloudMapConfig;
use crate::block_store::{BLOCK_SIDE, CellBits, cell_in_block};
use crate::places::Places;
use crate::weighting::Weighting;

/// Farthest distance at which a voxel looks for heavier ones, voxels: not beyond the blocks around its own.
const MAX_RADIUS: usize = BLOCK_SIDE;

/// Cells along each side of a cube of a [`Window`].
const CUBE: usize = 4;
const CUBE_CELLS: usize = CUBE.pow(3);

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
    /// x fastest, then y.
    cubes: Vec<Cube>,
    /// By cubes, and by cells within each; meaningless where a cube has no voxel.
    weights: Vec<f32>,
    /// Cubes with a weight that concerns a candidate, by that weight, the heaviest first.
    heavy_cubes: Vec<(f32, [usize; 3])>,
}

/// The voxels in a cube of a window.
#[derive(Debug, Clone, Copy, Default)]
struct Cube {
    /// Their greatest weight.
    heaviest: f32,
    /// Their cells, by bits.
    filled: u64,
}

impl Thinning {
    pub(crate) fn new(config: &CloudMapConfig, weighting: Weighting) -> Self {
        Self {
            min_observations: config.min_observations,
            radius: config.thinning_radius,
            voxel_size: config.voxel_size,
            weighting,
            inverse_unit: weighting.total(1) as f32,
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
        let cubes = self.cubes_along_axis().pow(3);
        self.cubes.clear();
        self.cubes.resize(cubes, Cube::default());
        self.weights.resize(self.weights.len().max(cubes * CUBE_CELLS), 0.0);
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
        // Of the index of a weight, what each coordinate of a cell adds.
        let along = self.cubes_along_axis();
        let parts = [0, 1, 2].map(|axis| {
            let first = self.radius.wrapping_add_signed(step[axis] as isize * BLOCK_SIDE as isize);
            let (cubes, cells) = (along.pow(axis as u32), CUBE.pow(axis as u32));
            std::array::from_fn::<usize, BLOCK_SIDE, _>(|c| {
                // Cells outside the window may be below zero: they are left out.
                let at = c.wrapping_add(first);
                (at / CUBE).wrapping_mul(CUBE_CELLS * cubes).wrapping_add(at % CUBE * cells)
            })
        });
        let columns = (0xFF_u64 >> (BLOCK_SIDE - xs.len()) << xs.start) * 0x0101_0101_0101_0101;
        let rows = u64::MAX >> (BLOCK_SIDE * (BLOCK_SIDE - ys.len())) << (BLOCK_SIDE * ys.start);
        let inside = columns & rows;
        places.for_each_in(
            zs,
            |z| voxels[z] & inside,
            |place, rank| {
                let [x, y, z] = cell_in_block(place).map(|c| c as usize);
                let index = parts[0][x].wrapping_add(parts[1][y]).wrapping_add(parts[2][z]);
                let (cube, cell) = (index / CUBE_CELLS, index % CUBE_CELLS);
                if let (Some(cube), Some(entry)) = (self.cubes.get_mut(cube), self.weights.get_mut(index)) {
                    *entry = weight(rank);
                    cube.heaviest = cube.heaviest.max(*entry);
                    cube.filled |= 1 << cell;
                }
            },
        );
    }

    /// To be called after the window is filled, before candidates ask it.
    pub(crate) fn sort_cubes(&mut self) {
        let along = self.cubes_along_axis();
        let place = |index: usize| [index % along, index / along % along, index / along / along];
        let heavy = self.cubes.iter().enumerate().filter(|(_, cube)| cube.heaviest > self.least_limit);
        self.heavy_cubes.clear();
        self.heavy_cubes.extend(heavy.map(|(index, cube)| (cube.heaviest, place(index))));
        self.heavy_cubes.sort_unstable_by(|a, b| b.0.total_cmp(&a.0));
    }

    /// Whether a candidate is noise: whether a voxel within its radius weighs more than its limit. Only cubes
    /// with such a voxel are searched, and most candidates on a surface have none.
    pub(crate) fn is_noise(&self, candidate: &Candidate) -> bool {
        let center = cell_in_block(candidate.place).map(|c| c as usize + self.radius);
        let mut heavier = self.heavy_cubes.iter().take_while(|(heaviest, _)| *heaviest > candidate.limit);
        heavier.any(|(_, cube)| self.cube_has_heavier(*cube, center, candidate))
    }

    /// Whether a voxel of a cube, within the candidate's radius from its centre, weighs more than its limit.
    fn cube_has_heavier(&self, place: [usize; 3], center: [usize; 3], candidate: &Candidate) -> bool {
        let reach = candidate.radius * candidate.radius;
        let first = place.map(|c| CUBE * c);
        let squared = |axis: usize, c: usize| c.abs_diff(center[axis]).pow(2);
        let nearest = |axis: usize| squared(axis, center[axis].clamp(first[axis], first[axis] + CUBE - 1));
        if (nearest(0) + nearest(1) + nearest(2)) as f32 > reach {
            return false;
        }
        let index = index(place, self.cubes_along_axis());
        let weights = &self.weights[cells_of(index)];
        let mut left = self.cubes[index].filled;
        while left != 0 {
            let cell = left.trailing_zeros() as usize;
            left &= left - 1;
            if weights[cell] > candidate.limit {
                let (x, y, z) = (cell % CUBE, cell / CUBE % CUBE, cell / CUBE / CUBE);
                let squared = squared(0, first[0] + x) + squared(1, first[1] + y) + squared(2, first[2] + z);
                if squared as f32 <= reach {
                    return true;
                }
            }
        }
        false
    }

    fn cubes_along_axis(&self) -> usize {
        (BLOCK_SIDE + 2 * self.radius).div_ceil(CUBE)
    }
}

/// The cells of a cube among the weights of a window.
fn cells_of(cube: usize) -> std::ops::Range<usize> {
    CUBE_CELLS * cube..CUBE_CELLS * (cube + 1)
}

/// The place of a cell, or cube, among so many along each axis.
fn index([x, y, z]: [usize; 3], side: usize) -> usize {
    (z * side + y) * side + x
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;

    use super::*;

    /// All cells of the window, one by one.
    fn has_heavier(window: &Window, candidate: &Candidate) -> bool {
        let center = cell_in_block(candidate.place).map(|c| c as usize + window.radius);
        let along = window.cubes_along_axis();
        (0..(CUBE * along).pow(3)).any(|cell| {
            let at = [cell, cell / (CUBE * along), cell / (CUBE * along).pow(2)].map(|c| c % (CUBE * along));
            let (cube, within) = (index(at.map(|c| c / CUBE), along), index(at.map(|c| c % CUBE), CUBE));
            let squared: usize = (0..3).map(|axis| at[axis].abs_diff(center[axis]).pow(2)).sum();
            window.cubes[cube].filled & (1 << within) != 0
                && window.weights[cells_of(cube)][within] > candidate.limit
                && squared as f32 <= candidate.radius * candidate.radius
        })
    }

    #[test]
    fn heavier_voxels_are_found_as_by_looking_at_all() {
        let mut random = SplitMix64::new(11);
        let (mut window, mut found) = (Window::default(), 0);
        for turn in 0..400 {
            let candidates: Vec<Candidate> = (0..20)
                .map(|_| Candidate {
                    place: (512.0 * random.fraction()) as usize,
                    limit: 1.0 + 9.0 * random.fraction() as f32,
                    radius: 1.0 + (7.0 * random.fraction()) as f32,
                })
                .collect();
            window.reset(&candidates);
            let all = [u64::MAX; 8];
            for step in (0..27).map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1]) {
                // From a voxel in hundreds to every tenth.
                let share = 0.1 * f64::from(turn % 20) / 20.0;
                let voxels =
                    all.map(|_| (0..64).fold(0, |bits, i| bits | u64::from(random.fraction() < share) << i));
                window.fill(step, &Places::new(voxels), &voxels, |rank| (rank % 11) as f32);
            }
            window.sort_cubes();
            for candidate in &candidates {
                let heavier = has_heavier(&window, candidate);
                assert_eq!(window.is_noise(candidate), heavier, "{candidate:?}");
                found += usize::from(heavier);
            }
        }
        assert!((2000..7000).contains(&found), "{found}");
    }
}
