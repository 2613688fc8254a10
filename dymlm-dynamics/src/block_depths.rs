use std::ops::Range;

use dymlm_core::{DepthImage, Frame, SensorModel};

/// Side of a block, in pixels of a 640x480 image: a thigh at 2 m covers some hundred blocks, and the mean of
/// sixteen readings has a quarter of the noise of one.
const SIDE: f64 = 4.0;
/// Least side of a block, in pixels of the image itself. Blocks are compared as means of several readings: with
/// one pixel a side a third of what stands still at 2 m seems to have moved (test
/// `a_seat_is_static_in_a_small_noisy_image`). A higher value makes chair legs too small to be judged.
const LEAST_SIDE: usize = 2;

/// Depths of a part of an image, one for each block of pixels: the mean of the block's readings that are
/// about as deep as the reading in its middle.
///
/// Reuse the buffer: filling it again allocates only when it must grow.
#[derive(Debug, Clone, Default)]
pub(crate) struct BlockDepths {
    /// Pixels along the side of a block; blocks begin at multiples of it.
    side: usize,
    /// Column and row of the first block.
    first: [usize; 2],
    columns: usize,
    /// Row by row; 0 = the middle pixel is not wanted or has no reading.
    depths: Vec<f32>,
}

impl BlockDepths {
    /// Computes the blocks that overlap `columns` and `rows` and whose middle pixel `is_wanted`. `scale` is
    /// the image's size relative to 640x480.
    pub(crate) fn fill(
        &mut self,
        depth: &DepthImage,
        scale: f64,
        sensor: &SensorModel,
        [columns, rows]: [Range<usize>; 2],
        is_wanted: impl Fn(usize, usize) -> bool,
    ) {
        self.side = ((SIDE * scale).round() as usize).max(LEAST_SIDE);
        self.first = [columns.start / self.side, rows.start / self.side];
        self.columns = columns.end.div_ceil(self.side).saturating_sub(self.first[0]);
        self.depths.clear();
        for row in self.first[1]..rows.end.div_ceil(self.side) {
            for column in self.first[0]..self.first[0] + self.columns {
                let [left, top] = [column, row].map(|c| c * self.side);
                let is_wanted = is_wanted(left + self.side / 2, top + self.side / 2);
                self.depths.push(if is_wanted {
                    mean_depth([left, top], self.side, depth, sensor)
                } else {
                    0.0
                });
            }
        }
    }

    /// The depths of the blocks, row by row; 0 = none.
    pub(crate) fn depths(&self) -> &[f32] {
        &self.depths
    }

    /// Pixels along the side of a block.
    pub(crate) fn side(&self) -> usize {
        self.side
    }

    /// The pixels of a block, columns and rows; they may reach beyond the image's border.
    pub(crate) fn pixels(&self, block: usize) -> [Range<usize>; 2] {
        let [column, row] = self.place(block);
        [self.first[0] + column, self.first[1] + row].map(|c| c * self.side..(c + 1) * self.side)
    }

    /// The middle of a block, pixels.
    pub(crate) fn center(&self, block: usize) -> [f64; 2] {
        self.pixels(block).map(|range| range.start as f64 + self.half())
    }

    /// The pairs of depths on opposite sides of a block, `steps` blocks away, along rows, columns and both
    /// diagonals; only pairs in which both depths are known.
    pub(crate) fn opposite(&self, block: usize, steps: usize) -> impl Iterator<Item = [f32; 2]> + use<'_> {
        let [column, row] = self.place(block);
        let is_wide = column >= steps && column + steps < self.columns;
        let is_high = row >= steps && row + steps < self.rows();
        // Of places as near as no camera reads, the steps are more than there are blocks.
        let down = steps.saturating_mul(self.columns);
        let pairs = [
            (is_wide, steps),
            (is_high, down),
            (is_wide && is_high, down.saturating_add(steps)),
            (is_wide && is_high, down.saturating_sub(steps)),
        ];
        let sides = pairs.into_iter().filter(|&(is_in, _)| is_in);
        let sides = sides.map(move |(_, offset)| [self.depths[block - offset], self.depths[block + offset]]);
        sides.filter(|&[a, b]| a > 0.0 && b > 0.0)
    }

    /// The blocks left, right, above and below a block.
    pub(crate) fn neighbours(&self, block: usize) -> impl Iterator<Item = usize> + use<> {
        let [column, row] = self.place(block);
        let neighbours = [
            (column > 0, block.wrapping_sub(1)),
            (column + 1 < self.columns, block + 1),
            (row > 0, block.wrapping_sub(self.columns)),
            (row + 1 < self.rows(), block + self.columns),
        ];
        neighbours.into_iter().filter(|&(is_in, _)| is_in).map(|(_, neighbour)| neighbour)
    }

    /// The depth at a pixel, interpolated between the four blocks around it if their depths differ by at most
    /// `tolerance`, that is, if they lie on one surface; otherwise the one of them that is closest to
    /// `expected`. 0 = no reading.
    pub(crate) fn reading(&self, pixel: [f64; 2], expected: f64, tolerance: f64) -> f64 {
        let side = self.side.max(1) as f64;
        let place: [f64; 2] =
            std::array::from_fn(|axis| (pixel[axis] - self.half()) / side - self.first[axis] as f64);
        let [column, row] = place.map(|c| c.floor() as i64);
        let [x, y] = [place[0] - column as f64, place[1] - row as f64];
        let four = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(right, down)| {
            let block = self.index(column + right, row + down);
            block.map_or(0.0, |block| f64::from(self.depths[block]))
        });
        let least = four.iter().copied().fold(f64::INFINITY, f64::min);
        let most = four.iter().copied().fold(0.0, f64::max);
        if least > 0.0 && most - least <= tolerance {
            let [above, below] = [four[0] + x * (four[1] - four[0]), four[2] + x * (four[3] - four[2])];
            return above + y * (below - above);
        }
        let read = four.into_iter().filter(|&z| z > 0.0);
        read.min_by(|a, b| (a - expected).abs().total_cmp(&(b - expected).abs())).unwrap_or(0.0)
    }

    /// Distance from the first pixel of a block to its middle, pixels.
    fn half(&self) -> f64 {
        0.5 * (self.side as f64 - 1.0)
    }

    fn rows(&self) -> usize {
        self.depths.len() / self.columns.max(1)
    }

    fn place(&self, block: usize) -> [usize; 2] {
        let columns = self.columns.max(1);
        [block % columns, block / columns]
    }

    fn index(&self, column: i64, row: i64) -> Option<usize> {
        let (column, row) = (usize::try_from(column).ok()?, usize::try_from(row).ok()?);
        let block = row * self.columns + column;
        (column < self.columns && block < self.depths.len()).then_some(block)
    }
}

/// Where the surface in a square of pixels is, in the camera's frame: the middle of the square at the mean of
/// those readings that are about as deep as the reading there; `None` when there is no reading.
pub(crate) fn mean_place(
    corner: [usize; 2],
    side: usize,
    frame: &Frame,
    sensor: &SensorModel,
) -> Option<[f64; 3]> {
    let z = mean_depth(corner, side, frame.depth(), sensor);
    let middle = corner.map(|c| c as f64 + 0.5 * (side as f64 - 1.0));
    (z > 0.0).then(|| frame.camera().back_project(middle, z.into()))
}

/// The mean of those readings in a square that are about as deep as the reading in its middle; 0 = no reading.
fn mean_depth([left, top]: [usize; 2], side: usize, depth: &DepthImage, sensor: &SensorModel) -> f32 {
    let (columns, rows) = (left..(left + side).min(depth.width()), top..(top + side).min(depth.height()));
    let around = depth.at(left + side / 2, top + side / 2);
    if around <= 0.0 {
        return 0.0;
    }
    let tolerance = sensor.tolerance(around, 0.0) as f32;
    // Four sums side by side, so that the compiler can vectorize.
    let (mut sums, mut counts) = ([0.0_f32; 4], [0.0_f32; 4]);
    for v in rows {
        for readings in depth.row(v)[columns.clone()].chunks(4) {
            for (&z, (sum, count)) in readings.iter().zip(sums.iter_mut().zip(&mut counts)) {
                let share = f32::from(u8::from((z - around).abs() <= tolerance));
                *sum += share * z;
                *count += share;
            }
        }
    }
    sums.iter().sum::<f32>() / counts.iter().sum::<f32>().max(1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A plane that recedes to the right by 1 mm a pixel, and a hole.
    fn blocks() -> BlockDepths {
        let hole = |i: usize| (16..20).contains(&(i % 64)) && (8..12).contains(&(i / 64));
        let depth = (0..64 * 48).map(|i| if hole(i) { 0.0 } else { 1.0 + 0.001 * (i % 64) as f32 }).collect();
        let depth = DepthImage::new(64, 48, depth).unwrap();
        let mut blocks = BlockDepths::default();
        blocks.fill(&depth, 1.0, &SensorModel::kinect(), [9..50, 5..48], |_, _| true);
        blocks
    }

    #[test]
    fn readings_between_blocks_are_those_of_the_surface() {
        let blocks = blocks();
        for pixel in [[15.0, 20.0], [21.3, 30.7], [40.0, 41.5]] {
            assert!((blocks.reading(pixel, 1.0, 0.02) - (1.0 + 0.001 * pixel[0])).abs() < 1e-4);
        }
        // Beside the hole: the closest of the remaining depths. Outside: no reading.
        assert!((blocks.reading([16.0, 8.0], 1.0, 0.02) - 1.0135).abs() < 1e-4);
        assert_eq!(blocks.reading([60.0, 20.0], 1.0, 0.02), 0.0);
    }

    #[test]
    fn blocks_know_their_pixels_and_neighbours() {
        let blocks = blocks();
        assert_eq!(blocks.pixels(0), [8..12, 4..8]);
        assert_eq!(blocks.center(1), [13.5, 5.5]);
        assert_eq!(blocks.neighbours(0).collect::<Vec<_>>(), [1, 11]);
        assert_eq!(blocks.depths().len(), 11 * 11);
        assert_eq!(blocks.opposite(0, 1).count(), 0);
        let [left, right] = blocks.opposite(5 * 11 + 5, 2).next().unwrap();
        assert!((right - left - 0.016).abs() < 1e-5);
    }
}
