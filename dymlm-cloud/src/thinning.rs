use crate::CloudMapConfig;
use crate::block_store::{BLOCK_SIDE, CellBits, cell_in_block, for_each_bit};
use crate::places::Places;
use crate::weighting::Weighting;

/// Farthest distance at which a voxel looks for heavier ones, voxels: not beyond the blocks around its own.
const MAX_RADIUS: usize = BLOCK_SIDE;

/// Columns of a [`Window`]; greatest number of its layers, and of their rows.
const WINDOW_SIDE: usize = BLOCK_SIDE + 2 * MAX_RADIUS;
/// By square, the root, rounded down.
const ROOTS: [u8; MAX_RADIUS * MAX_RADIUS + 1] = roots();

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
/// two as long as they are further apart than that. Where the readings around are known to be those of a single
/// surface, the voxels through which it passes are no noise, however much its other parts weigh: what is read
/// from aside, or at the border of what was seen, weighs little.
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
///
/// What lies within a radius of a voxel is a ball of discs, one a layer. The greatest weights in the cube
/// around each ball, and in the square around each disc, are found once for all voxels of the block: most voxels
/// need not look at weights one by one.
#[derive(Debug)]
pub(crate) struct Window {
    /// How far it reaches beyond the block, voxels.
    radius: usize,
    /// The least limit of the candidates.
    least_limit: f32,
    /// By layers, which rows have a weight that concerns a candidate, by bits.
    filled: [u32; WINDOW_SIDE],
    /// The weights by rows, layer by layer.
    rows: Vec<[f32; WINDOW_SIDE]>,
    /// By rows, the greatest weight within the window's radius from each column of the block.
    in_rows: Vec<Columns>,
    /// By layers, the greatest weight in the square with this radius around each column and row of the block.
    in_squares: [[Columns; BLOCK_SIDE]; WINDOW_SIDE],
    /// The greatest weight in such a cube around each voxel of the block.
    in_cubes: [[Columns; BLOCK_SIDE]; BLOCK_SIDE],
}

/// A number for each column of a block.
type Columns = [f32; BLOCK_SIDE];

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

impl Default for Window {
    fn default() -> Self {
        Self {
            radius: 0,
            least_limit: 0.0,
            filled: [0; WINDOW_SIDE],
            rows: Vec::new(),
            in_rows: Vec::new(),
            in_squares: [Default::default(); WINDOW_SIDE],
            in_cubes: Default::default(),
        }
    }
}

impl Window {
    /// Empties the window, and makes it wide enough for all candidates.
    pub(crate) fn reset(&mut self, candidates: &[Candidate]) {
        self.for_each_filled(|window, row| {
            window.rows[row] = [0.0; WINDOW_SIDE];
        });
        self.filled = [0; WINDOW_SIDE];
        let radius = candidates.iter().map(|candidate| candidate.radius).fold(1.0, f32::max);
        self.radius = radius as usize;
        self.least_limit = candidates.iter().map(|candidate| candidate.limit).fold(f32::INFINITY, f32::min);
        let side = self.side();
        self.rows.resize(self.rows.len().max(side * side), [0.0; WINDOW_SIDE]);
        self.in_rows.resize(self.rows.len(), Columns::default());
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
        let columns = (0xFF_u64 >> (BLOCK_SIDE - xs.len()) << xs.start) * 0x0101_0101_0101_0101;
        let rows = u64::MAX >> (BLOCK_SIDE * (BLOCK_SIDE - ys.len())) << (BLOCK_SIDE * ys.start);
        let inside = columns & rows;
        // The first cell of a block may lie before the window: then its coordinates wrap.
        let first = |axis: usize, before: usize| {
            before.wrapping_add_signed(step[axis] as isize * BLOCK_SIDE as isize)
        };
        let (first_x, side) = (first(0, MAX_RADIUS), self.side());
        let (first_y, first_z) = (first(1, self.radius), first(2, self.radius));
        places.for_each_in(
            zs,
            |z| voxels[z] & inside,
            |place, rank| {
                let weight = weight(rank);
                if weight <= self.least_limit {
                    return;
                }
                let [x, y, z] = cell_in_block(place).map(|c| c as usize);
                let (y, z) = (first_y.wrapping_add(y), first_z.wrapping_add(z));
                let row = self.rows.get_mut(z * side + y);
                if let Some(entry) = row.and_then(|row| row.get_mut(first_x + x)) {
                    *entry = weight;
                    self.filled[z] |= 1 << y;
                }
            },
        );
    }

    /// To be called after the window is filled, before candidates ask it.
    pub(crate) fn find_heaviest(&mut self) {
        self.for_each_filled(|window, row| {
            let weights = &window.rows[row];
            let mut heaviest = columns(weights, MAX_RADIUS);
            for half in 1..=window.radius {
                let (left, right) =
                    (columns(weights, MAX_RADIUS - half), columns(weights, MAX_RADIUS + half));
                heaviest = greater(heaviest, greater(left, right));
            }
            window.in_rows[row] = heaviest;
        });
        let (side, diameter) = (self.side(), 2 * self.radius);
        for (layer, squares) in self.in_squares[..side].iter_mut().enumerate() {
            let rows = &self.in_rows[layer * side..(layer + 1) * side];
            *squares = std::array::from_fn(|y| {
                let mut heaviest = Columns::default();
                let filled = self.filled[layer] >> y & ((2 << diameter) - 1);
                for_each_bit([filled.into()], |row| heaviest = greater(heaviest, rows[y + row]));
                heaviest
            });
        }
        let layers = &self.in_squares;
        let cube = |z: usize, y: usize| greatest(layers[z..=z + diameter].iter().map(|squares| squares[y]));
        self.in_cubes = std::array::from_fn(|z| std::array::from_fn(|y| cube(z, y)));
    }

    /// Whether a candidate is noise: whether a voxel within its radius weighs more than its limit.
    pub(crate) fn is_noise(&self, candidate: &Candidate) -> bool {
        let [x, y, z] = cell_in_block(candidate.place).map(|c| c as usize);
        if self.in_cubes[z][y][x] <= candidate.limit {
            return false;
        }
        let (middle, reach) = (z + self.radius, (candidate.radius * candidate.radius) as usize);
        (middle - root(reach)..=middle + root(reach)).any(|layer| {
            let left = reach - layer.abs_diff(middle).pow(2);
            self.in_squares[layer][y][x] > candidate.limit
                && self.disc_has_heavier([x, y, layer], left, candidate.limit)
        })
    }

    /// Whether a voxel weighs more than a limit in the disc around a column and row of the block, in a layer;
    /// `reach`: the square of the disc's radius.
    fn disc_has_heavier(&self, [x, y, layer]: [usize; 3], reach: usize, limit: f32) -> bool {
        let middle = y + self.radius;
        (middle - root(reach)..=middle + root(reach)).any(|row| {
            let half = root(reach - row.abs_diff(middle).pow(2));
            let columns = MAX_RADIUS + x - half..=MAX_RADIUS + x + half;
            self.rows[layer * self.side() + row][columns].iter().any(|weight| *weight > limit)
        })
    }

    /// Calls `visit` with the window and each row that has a weight.
    fn for_each_filled(&mut self, mut visit: impl FnMut(&mut Self, usize)) {
        let side = self.side();
        for layer in 0..side {
            for_each_bit([self.filled[layer].into()], |row| visit(self, layer * side + row));
        }
    }

    /// Number of layers, and of rows in each.
    fn side(&self) -> usize {
        BLOCK_SIDE + 2 * self.radius
    }
}

/// The weights of so many columns as a block has, from one of a row on.
fn columns(weights: &[f32; WINDOW_SIDE], first: usize) -> Columns {
    weights[first..].first_chunk().copied().unwrap_or_default()
}

/// The greater of two weights, by columns. Unlike `f32::max`, this is one instruction for four of them.
fn greater(a: Columns, b: Columns) -> Columns {
    std::array::from_fn(|x| if a[x] > b[x] { a[x] } else { b[x] })
}

/// The greatest of some weights, by columns.
fn greatest(weights: impl Iterator<Item = Columns>) -> Columns {
    weights.fold(Columns::default(), greater)
}

/// The root of a square up to that of the greatest radius, rounded down.
fn root(square: usize) -> usize {
    usize::from(ROOTS[square])
}

const fn roots() -> [u8; MAX_RADIUS * MAX_RADIUS + 1] {
    let mut roots = [0; MAX_RADIUS * MAX_RADIUS + 1];
    let mut square = 0;
    while square < roots.len() {
        roots[square] = square.isqrt() as u8;
        square += 1;
    }
    roots
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;

    use super::*;

    /// Looks at all voxels, one by one; `voxels`: cells from the lowest corner of the block, and weights.
    fn has_heavier(voxels: &[([i32; 3], f32)], candidate: &Candidate) -> bool {
        let center = cell_in_block(candidate.place);
        voxels.iter().any(|&(cell, weight)| {
            let squared: i32 = (0..3).map(|axis| (cell[axis] - center[axis]).pow(2)).sum();
            weight > candidate.limit && squared as f32 <= candidate.radius * candidate.radius
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
            let mut filled = Vec::new();
            let all = [u64::MAX; 8];
            for step in (0..27).map(|i| [i % 3 - 1, i / 3 % 3 - 1, i / 9 - 1]) {
                // From a voxel in hundreds to every tenth.
                let share = 0.1 * f64::from(turn % 20) / 20.0;
                let voxels =
                    all.map(|_| (0..64).fold(0, |bits, i| bits | u64::from(random.fraction() < share) << i));
                let places = Places::new(voxels);
                let weight = |rank: usize| (rank % 11) as f32;
                window.fill(step, &places, &voxels, weight);
                places.for_each(&voxels, |place, rank| {
                    let cell = cell_in_block(place);
                    filled.push(([0, 1, 2].map(|axis| 8 * step[axis] + cell[axis]), weight(rank)));
                });
            }
            window.find_heaviest();
            for candidate in &candidates {
                let heavier = has_heavier(&filled, candidate);
                assert_eq!(window.is_noise(candidate), heavier, "{candidate:?}");
                found += usize::from(heavier);
            }
        }
        assert!((2000..7000).contains(&found), "{found}");
    }
}
