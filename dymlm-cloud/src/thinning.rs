use std::ops::Range;

use crate::CloudMapConfig;
use crate::block_store::{BLOCK_CELLS, BLOCK_SIDE, CellBits, cell_in_block, for_each_bit};
use crate::places::Places;
use crate::weighting::Weighting;

/// Farthest distance at which a voxel looks for heavier ones, voxels: not beyond the blocks around its own.
const MAX_RADIUS: usize = BLOCK_SIDE;

/// Columns of a [`Window`]; greatest number of its layers, and of their rows.
const WINDOW_SIDE: usize = BLOCK_SIDE + 2 * MAX_RADIUS;
/// Number of squares of radii, rounded down.
const REACHES: usize = MAX_RADIUS * MAX_RADIUS + 1;
/// By square, the root, rounded down.
const ROOTS: [u8; REACHES] = roots();

/// Greatest radius of a window in which the rows around a voxel are looked at without knowing the greatest weight
/// in the cube around it: finding that would cost more than it saves.
const MAX_SMALL_RADIUS: usize = 3;

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
/// What lies within a radius of a voxel is a ball of discs, one a layer, and a disc is made of pieces of rows. The
/// greatest weight in each piece of a row is found once for all voxels of the block, and where radii are large
/// that in the cube around each ball: no voxel looks at weights one by one.
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
    /// By rows, then by distances up to the window's radius: the greatest weight within the distance from each
    /// column of the block.
    in_rows: Vec<Columns>,
    /// By layers, the greatest weight in the square with this radius around each column and row of the block.
    in_squares: [[Columns; BLOCK_SIDE]; WINDOW_SIDE],
    /// The greatest weight in such a cube around each voxel of the block.
    in_cubes: [[Columns; BLOCK_SIDE]; BLOCK_SIDE],
    /// By radii of windows and squares of radii of balls, what makes up a ball; empty until it is asked for.
    balls: Vec<Vec<u32>>,
}

/// A number for each column of a block.
type Columns = [f32; BLOCK_SIDE];

/// The weights of a block's voxels, by places; 0 where there is none.
pub(crate) type Weights = [f32; BLOCK_CELLS];

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
        self.radius_of(self.weighting.weight_per_frame(weight, observations))
    }

    /// The same for a voxel of this [weight per frame](Weighting::weight_per_frame): the less the farther.
    pub(crate) fn radius_of(&self, weight_per_frame: f64) -> f32 {
        let deviation = self.weighting.deviation_of(weight_per_frame) / self.voxel_size;
        ((self.radius * deviation) as f32).min(MAX_RADIUS as f32)
    }

    /// Mean weight of a voxel's readings.
    #[inline]
    pub(crate) fn weight_per_frame(&self, weight: u64, observations: u32) -> f64 {
        self.weighting.weight_per_frame(weight, observations)
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
            balls: vec![Vec::new(); (MAX_RADIUS + 1) * REACHES],
            in_cubes: Default::default(),
        }
    }
}

impl Window {
    /// Empties the window, and makes it wide enough for all candidates.
    pub(crate) fn reset(&mut self, candidates: &[Candidate]) {
        let side = self.side();
        for (layer, filled) in self.filled.iter_mut().enumerate() {
            let rows = &mut self.rows;
            for_each_bit([std::mem::take(filled).into()], |row| {
                rows[layer * side + row] = [0.0; WINDOW_SIDE];
            });
        }
        let radius = candidates.iter().map(|candidate| candidate.radius).fold(1.0, f32::max);
        self.radius = radius as usize;
        self.least_limit = candidates.iter().map(|candidate| candidate.limit).fold(f32::INFINITY, f32::min);
        let rows = self.side() * self.side();
        self.rows.resize(self.rows.len().max(rows), [0.0; WINDOW_SIDE]);
        self.in_rows.resize(self.in_rows.len().max(rows * self.pieces()), Columns::default());
    }

    /// Weights up to this concern no candidate.
    pub(crate) fn least_limit(&self) -> f32 {
        self.least_limit
    }

    /// Puts in the weights of some of a block's voxels; `step` leads from the middle block to this one.
    pub(crate) fn fill(&mut self, step: [i32; 3], voxels: &CellBits, weights: &Weights) {
        let part = Part::of_block(self.radius, step);
        for z in part.layers.clone() {
            let mut bits = voxels[z] & part.rows;
            while bits != 0 {
                // All voxels of a row at once.
                let y = bits.trailing_zeros() as usize / BLOCK_SIDE;
                let chosen = (voxels[z] >> (BLOCK_SIDE * y)) as u8;
                bits &= !(0xFF << (BLOCK_SIDE * y));
                let from = (BLOCK_SIDE * z + y) * BLOCK_SIDE;
                let Some(own) = weights[from..].first_chunk::<BLOCK_SIDE>() else { continue };
                let chosen = &CHOSEN[usize::from(chosen)];
                let own: Columns = std::array::from_fn(|x| f32::from_bits(own[x].to_bits() & chosen[x]));
                if heaviest_of(&own) > self.least_limit
                    && let Some(row) = self.row_of(&part, y, z)
                {
                    *row = own;
                }
            }
        }
    }

    /// The same for weights that are given by rank.
    pub(crate) fn fill_by_rank(
        &mut self,
        step: [i32; 3],
        places: &Places,
        voxels: &CellBits,
        weight: impl Fn(usize) -> f32,
    ) {
        let part = Part::of_block(self.radius, step);
        let inside = part.columns & part.rows;
        places.for_each_in(
            part.layers.clone(),
            |z| voxels[z] & inside,
            |place, rank| {
                let weight = weight(rank);
                if weight > self.least_limit {
                    let [x, y, z] = cell_in_block(place).map(|c| c as usize);
                    if let Some(row) = self.row_of(&part, y, z) {
                        row[x] = weight;
                    }
                }
            },
        );
    }

    /// The entries of a row of a block's voxels, which has a weight from now on.
    #[inline]
    fn row_of(&mut self, part: &Part, y: usize, z: usize) -> Option<&mut Columns> {
        let [x, first_y, first_z] = part.first;
        let (y, z) = (first_y.wrapping_add(y), first_z.wrapping_add(z));
        let row = z * self.side() + y;
        *self.filled.get_mut(z)? |= 1 << y;
        self.rows.get_mut(row)?.get_mut(x..)?.first_chunk_mut()
    }

    /// To be called after the window is filled, before candidates ask it.
    pub(crate) fn find_heaviest(&mut self) {
        let (side, pieces) = (self.side(), self.pieces());
        let layers = self.in_rows.chunks_exact_mut(side * pieces).zip(self.rows.chunks_exact(side));
        for ((in_rows, rows), filled) in layers.zip(&self.filled[..side]) {
            for (y, (found, weights)) in in_rows.chunks_exact_mut(pieces).zip(rows).enumerate() {
                if filled >> y & 1 == 0 {
                    found.fill(Columns::default());
                    continue;
                }
                let mut heaviest = columns(weights, MAX_RADIUS);
                for (half, found) in found.iter_mut().enumerate() {
                    let (left, right) =
                        (columns(weights, MAX_RADIUS - half), columns(weights, MAX_RADIUS + half));
                    heaviest = greater(heaviest, greater(left, right));
                    *found = heaviest;
                }
            }
        }
        if self.radius > MAX_SMALL_RADIUS {
            self.find_heaviest_around();
        }
    }

    /// The greatest weights in squares and cubes, from those in rows.
    fn find_heaviest_around(&mut self) {
        let (side, pieces, diameter) = (self.side(), self.pieces(), 2 * self.radius);
        for (layer, squares) in self.in_squares[..side].iter_mut().enumerate() {
            *squares = Default::default();
            for_each_bit([self.filled[layer].into()], |row| {
                let in_row = self.in_rows[(layer * side + row) * pieces + self.radius];
                // Squares begin at rows from the one `diameter` before this one on.
                let last = row.min(BLOCK_SIDE - 1);
                for square in &mut squares[row.saturating_sub(diameter)..=last] {
                    *square = greater(*square, in_row);
                }
            });
        }
        let layers = &self.in_squares;
        let cube = |z: usize, y: usize| greatest(layers[z..=z + diameter].iter().map(|squares| squares[y]));
        self.in_cubes = std::array::from_fn(|z| std::array::from_fn(|y| cube(z, y)));
    }

    /// Whether a candidate is noise: whether a voxel within its radius weighs more than its limit.
    #[inline]
    pub(crate) fn is_noise(&mut self, candidate: &Candidate) -> bool {
        let [x, y, z] = cell_in_block(candidate.place).map(|c| c as usize);
        if self.radius > MAX_SMALL_RADIUS && self.in_cubes[z][y][x] <= candidate.limit {
            return false;
        }
        let reach = (candidate.radius * candidate.radius) as usize;
        let (first, number) = ((z * self.side() + y) * self.pieces(), self.radius * REACHES + reach);
        if self.balls[number].is_empty() {
            self.balls[number] = self.pieces_of_ball(reach);
        }
        let mut pieces = self.balls[number].iter();
        pieces.any(|&piece| self.in_rows[first + piece as usize][x] > candidate.limit)
    }

    /// Where `in_rows` has the pieces of rows that make up the ball around the first voxel of the block; `reach`: the
    /// square of its radius. For another voxel they lie as much farther as its row.
    fn pieces_of_ball(&self, reach: usize) -> Vec<u32> {
        let middle = self.radius;
        let around = |square: usize| middle - root(square)..=middle + root(square);
        let mut pieces = Vec::new();
        for layer in around(reach) {
            let left = reach - layer.abs_diff(middle).pow(2);
            for row in around(left) {
                let half = root(left - row.abs_diff(middle).pow(2));
                pieces.push(((layer * self.side() + row) * self.pieces() + half) as u32);
            }
        }
        pieces
    }

    /// Number of layers, and of rows in each.
    fn side(&self) -> usize {
        BLOCK_SIDE + 2 * self.radius
    }

    /// Number of distances in a row.
    fn pieces(&self) -> usize {
        self.radius + 1
    }
}

/// The part of a block that lies in a window.
struct Part {
    layers: Range<usize>,
    /// Bits of the rows and of the columns in a layer, which is a word.
    rows: u64,
    columns: u64,
    /// Where the block's first cell is: the column, the row and the layer of the window. Row and layer wrap
    /// where they lie before the window.
    first: [usize; 3],
}

impl Part {
    /// `step` leads from the middle block of a window with this radius to the block.
    fn of_block(radius: usize, step: [i32; 3]) -> Self {
        let [xs, ys, layers] = step.map(|step| match step {
            -1 => BLOCK_SIDE - radius..BLOCK_SIDE,
            0 => 0..BLOCK_SIDE,
            _ => 0..radius,
        });
        let columns = (0xFF_u64 >> (BLOCK_SIDE - xs.len()) << xs.start) * 0x0101_0101_0101_0101;
        let rows = u64::MAX >> (BLOCK_SIDE * (BLOCK_SIDE - ys.len())) << (BLOCK_SIDE * ys.start);
        let first = |axis: usize, before: usize| {
            before.wrapping_add_signed(step[axis] as isize * BLOCK_SIDE as isize)
        };
        Self { layers, rows, columns, first: [first(0, MAX_RADIUS), first(1, radius), first(2, radius)] }
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

/// The greatest weight of a row.
#[inline]
fn heaviest_of(row: &Columns) -> f32 {
    let halves: [f32; 4] = std::array::from_fn(|x| if row[x] > row[x + 4] { row[x] } else { row[x + 4] });
    halves[0].max(halves[1]).max(halves[2].max(halves[3]))
}

/// The greatest of some weights, by columns.
fn greatest(weights: impl Iterator<Item = Columns>) -> Columns {
    weights.fold(Columns::default(), greater)
}

/// The root of a square up to that of the greatest radius, rounded down.
fn root(square: usize) -> usize {
    usize::from(ROOTS[square])
}

/// For each choice of columns, as bits, the bits of a weight that stay in each column.
static CHOSEN: [[u32; BLOCK_SIDE]; 256] = chosen();

const fn chosen() -> [[u32; BLOCK_SIDE]; 256] {
    let mut chosen = [[0; BLOCK_SIDE]; 256];
    let mut place = 0;
    while place < 256 * BLOCK_SIDE {
        if (place / BLOCK_SIDE) >> (place % BLOCK_SIDE) & 1 == 1 {
            chosen[place / BLOCK_SIDE][place % BLOCK_SIDE] = u32::MAX;
        }
        place += 1;
    }
    chosen
}

const fn roots() -> [u8; REACHES] {
    let mut roots = [0; REACHES];
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
                if turn % 2 == 0 {
                    let mut weights = [9.0; BLOCK_CELLS];
                    places.for_each(&voxels, |place, rank| weights[place] = weight(rank));
                    window.fill(step, &voxels, &weights);
                } else {
                    window.fill_by_rank(step, &places, &voxels, weight);
                }
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
