/// Number of blocks in a neighbourhood along each axis.
const SIDE: usize = 3;
/// A variable varies by itself when others leave this share of its variance: less is rounding.
const LEAST_SHARE: f64 = 1e-9;

/// The columns of blocks of a neighbourhood of 3 x 3 x 3 blocks that stand on a surface.
///
/// A thing that stands before a wall, closer to it than the noise is wide, hardly makes both together any
/// thicker than the wall. But the mean of a column lies where its surface is, however wide the noise, and the
/// thing moves the means of those columns in which it stands.
pub(super) struct Columns {
    /// The axis along which they stand: the one that the surface's normal is closest to.
    up: usize,
    /// The normal's part along it: from a distance along the columns to one across the surface.
    across: f64,
    /// By columns.
    sums: [Sums; SIDE * SIDE],
}

/// Sums over the voxels of a column: weights, and weight times place.
#[derive(Clone, Copy, Default)]
struct Sums {
    weight: f64,
    places: [f64; 3],
}

impl Columns {
    /// No blocks yet; `normal`: of the surface.
    pub(super) fn along(normal: [f64; 3]) -> Self {
        let longest = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()));
        let up = longest.unwrap_or(0);
        Self { up, across: normal[up], sums: Default::default() }
    }

    /// Adds a block to which `step` leads from the middle one: its weight, and the sum of weight times place.
    pub(super) fn add(&mut self, step: [i32; 3], weight: f64, places: [f64; 3]) {
        let [a, b, _] = self.axes().map(|axis| (step[axis] + 1).clamp(0, 2) as usize);
        let column = &mut self.sums[SIDE * a + b];
        column.weight += weight;
        for (sum, place) in column.places.iter_mut().zip(places) {
            *sum += place;
        }
    }

    /// The variance of the columns' means across the surface, from the plane that fits these means best.
    ///
    /// That plane is not the one that fits the voxels best: where the neighbourhood ends, the noise of an
    /// inclined wall is cut off on one side, which turns it.
    pub(super) fn unevenness(&self) -> f64 {
        let filled = || self.sums.iter().filter(|column| column.weight > 0.0);
        let weight: f64 = filled().map(|column| column.weight).sum();
        let axes = self.axes();
        let mean = axes.map(|axis| filled().map(|column| column.places[axis]).sum::<f64>() / weight);
        // Sums of weight times the products of the places from the mean.
        let mut products = [[0.0; 3]; 3];
        for column in filled() {
            let from_mean: [f64; 3] =
                std::array::from_fn(|axis| column.places[axes[axis]] / column.weight - mean[axis]);
            for (row, a) in products.iter_mut().zip(from_mean) {
                for (sum, b) in row.iter_mut().zip(from_mean) {
                    *sum += column.weight * a * b;
                }
            }
        }
        unexplained(products) / weight * self.across * self.across
    }

    /// The two axes across the columns, then the one along them.
    fn axes(&self) -> [usize; 3] {
        [(self.up + 1) % 3, (self.up + 2) % 3, self.up]
    }
}

/// The part of the sum of the squares of the last of three variables that the first two do not explain (least
/// squares), from the sums of their products. A variable that does not vary explains nothing.
fn unexplained([[aa, ab, ah], [_, bb, bh], [_, _, hh]]: [[f64; 3]; 3]) -> f64 {
    let slope = |product: f64, square: f64, whole: f64| {
        if square > LEAST_SHARE * whole { product / square } else { 0.0 }
    };
    // What a explains is taken out of b and h first.
    let (b_by_a, h_by_a) = (slope(ab, aa, aa), slope(ah, aa, aa));
    let (rest_bb, rest_bh, rest_hh) = (bb - b_by_a * ab, bh - b_by_a * ah, hh - h_by_a * ah);
    (rest_hh - slope(rest_bh, rest_bb, bb) * rest_bh).max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Nine blocks of 8 voxels whose readings lie at heights along an axis.
    fn columns(up: usize, height: impl Fn(f64, f64) -> f64) -> Columns {
        let mut normal = [0.1, -0.2, 0.1];
        normal[up] = -1.0;
        let mut columns = Columns::along(normal);
        let steps = (-1..=1).flat_map(|a| (-1..=1).map(move |b| [a, b]));
        for [a, b] in steps {
            let (weight, across) = (2.0, [a, b].map(|step| f64::from(8 * step)));
            let (mut step, mut place) = ([0; 3], [0.0; 3]);
            (step[(up + 1) % 3], step[(up + 2) % 3]) = (a, b);
            (place[(up + 1) % 3], place[(up + 2) % 3]) = (across[0], across[1]);
            place[up] = height(across[0], across[1]);
            columns.add(step, weight, place.map(|c| weight * c));
        }
        columns
    }

    #[test]
    fn a_plane_is_even_however_it_is_inclined() {
        for (a, b) in [(0.0, 0.0), (0.4, -0.2), (1.0, 0.9)] {
            let unevenness = columns(2, |x, y| a * x + b * y + 0.5).unevenness();
            assert!(unevenness < 1e-9, "{unevenness}");
        }
    }

    #[test]
    fn a_thing_before_one_column_or_a_row_of_them_is_uneven_along_every_axis() {
        for up in 0..3 {
            // 0, 0 and 3 in thirds vary by 2; one of nine by 8/9.
            let row = columns(up, |_, b| if b == 0.0 { 3.0 } else { 0.0 }).unevenness();
            assert!((row - 2.0).abs() < 1e-9, "{row}");
            let one = columns(up, |a, b| if [a, b] == [0.0, 0.0] { 3.0 } else { 0.0 }).unevenness();
            assert!((one - 8.0 / 9.0).abs() < 1e-9, "{one}");
        }
    }

    #[test]
    fn blocks_of_one_column_or_of_one_row_are_even() {
        let mut one = Columns::along([0.0, 0.0, 1.0]);
        one.add([0; 3], 2.0, [0.2, 0.4, 6.0]);
        one.add([0, 0, 1], 2.0, [0.4, 0.2, 16.0]);
        assert!(one.unevenness() < 1e-9);
        let mut row = Columns::along([0.0, 0.0, 1.0]);
        row.add([-1, 0, 0], 1.0, [-8.0, 0.0, 1.0]);
        row.add([1, 0, 0], 1.0, [8.0, 0.0, 3.0]);
        assert!(row.unevenness() < 1e-9);
    }
}
