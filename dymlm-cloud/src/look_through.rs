use dymlm_core::{DepthImage, PinholeCamera, Pose, SensorModel};

use crate::block_store::{BLOCK_CELLS, BLOCK_SIDE, CellBits, cell_in_block};
use crate::depth_tiles::DepthTiles;
use crate::rounding::{ROUNDING_LIMIT, round_to_i32};

/// Depth up to which blocks are looked into whatever was read before them, metres; more where the sensor
/// reads nothing nearer.
pub(crate) const NEAREST: f32 = 0.05;

/// Finds the cells that a frame looks through.
///
/// A frame looks through a cell when the reading at the cell's centre lies beyond it by more than the
/// sensor's tolerance ([`Visibility::Absent`](dymlm_core::Visibility::Absent)), whatever it is a reading of:
/// somebody who walks behind a place also shows that the place is free.
///
/// Cost a frame: one comparison with the image for each block of 8^3 cells between the camera and the
/// readings, and one for each cell of the blocks that contain readings; independent of the number of frames
/// before and of what lies behind the readings.
#[derive(Debug, Clone)]
pub(crate) struct LookThrough {
    cell_size: f64,
    sensor: SensorModel,
    /// Uncertainty of a surface's place in a cell when taken for its centre, metres: half the cell's
    /// diagonal.
    place_sigma: f64,
    view: View,
    tiles: DepthTiles,
    samples: Box<CellSamples>,
    /// The blocks that the frame may look through; and the cubes that are still to be judged: lowest block,
    /// and the logarithm to base 2 of the side in blocks.
    found: Vec<FoundBlock>,
    cubes: Vec<([i32; 3], u32)>,
}

/// A block in which a frame may look through something.
#[derive(Debug, Clone, Copy, PartialEq)]
struct FoundBlock {
    place: [i32; 3],
    /// Centre of the block in the camera's frame, metres.
    center: [f32; 3],
    /// Whether the frame looks through the whole block.
    is_whole: bool,
}

/// What part of a block a frame looks through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LookedThrough {
    All,
    Cells(CellBits),
}

/// Camera and pose of the current frame.
#[derive(Debug, Clone, Copy, Default)]
struct View {
    fx: f32,
    fy: f32,
    cx: f32,
    cy: f32,
    camera_from_world: Pose,
    /// x / z at the left and the right border of the image, y / z at the upper and the lower border, each a
    /// pixel outside.
    slopes: [[f32; 2]; 2],
    /// Lowest and highest block coordinates around what is seen.
    low: [i32; 3],
    high: [i32; 3],
}

/// Where the cells of one block lie in the image.
#[derive(Debug, Clone)]
struct CellSamples {
    /// Cell centres relative to the block's centre, in the camera's frame, metres; one array an axis.
    offsets: [[f32; BLOCK_CELLS]; 3],
    /// Depth beyond which a reading must lie to look through the cell.
    far_enough: [f32; BLOCK_CELLS],
    /// The pixel at which the cell's centre appears.
    column: [i32; BLOCK_CELLS],
    row: [i32; BLOCK_CELLS],
}

/// Result of comparing the whole footprint of a block, or of a cube of blocks, with the readings.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BlockVerdict {
    Nothing,
    All,
    Mixed,
}

impl LookThrough {
    pub(crate) fn new(cell_size: f64, sensor: SensorModel) -> Self {
        Self {
            cell_size,
            sensor,
            place_sigma: 0.75_f64.sqrt() * cell_size,
            view: View::default(),
            tiles: DepthTiles::default(),
            samples: Box::default(),
            found: Vec::new(),
            cubes: Vec::new(),
        }
    }

    /// Makes a frame the current one.
    pub(crate) fn take_view(&mut self, camera: &PinholeCamera, depth: &DepthImage, world_from_camera: &Pose) {
        let block_side = self.block_side();
        let [low, high] = blocks_around_view(camera, world_from_camera, self.sensor.max_depth, block_side);
        let slopes = |size: usize, center: f64, focal: f64| {
            let [a, b] = [-1.0, size as f64].map(|pixel| ((pixel - center) / focal) as f32);
            [a.min(b), a.max(b)]
        };
        self.view = View {
            slopes: [
                slopes(camera.width(), camera.cx(), camera.fx()),
                slopes(camera.height(), camera.cy(), camera.fy()),
            ],
            fx: camera.fx() as f32,
            fy: camera.fy() as f32,
            cx: camera.cx() as f32,
            cy: camera.cy() as f32,
            camera_from_world: world_from_camera.inverse(),
            low,
            high,
        };
        self.tiles.build(depth);
        self.samples.place_cells(&self.view.camera_from_world, self.cell_size);
    }

    /// Calls `count` for each block in which the current frame, whose depth is given again, looks through
    /// something.
    pub(crate) fn for_each_block(
        &mut self,
        depth: &DepthImage,
        mut count: impl FnMut([i32; 3], LookedThrough),
    ) {
        self.find_blocks();
        for index in 0..self.found.len() {
            let FoundBlock { place, center, is_whole } = self.found[index];
            if is_whole {
                count(place, LookedThrough::All);
                continue;
            }
            let cells = self.cells_looked_through(center, depth);
            if cells != CellBits::default() {
                count(place, LookedThrough::Cells(cells));
            }
        }
    }

    /// Finds the blocks in which the current frame may look through something: a cube of blocks is divided
    /// into eight, unless all readings in its footprint lie before it.
    fn find_blocks(&mut self) {
        let View { low, high, camera_from_world, .. } = self.view;
        let longest = (0..3).map(|axis| high[axis].saturating_sub(low[axis])).max().unwrap_or(0);
        let (side, radius) = (self.block_side(), self.block_radius());
        self.found.clear();
        self.cubes.clear();
        self.cubes.push((low, (longest.max(0) as u32).checked_ilog2().map_or(0, |log| log + 1)));
        while let Some((corner, level)) = self.cubes.pop() {
            let half = 0.5 * f64::from(1_u32 << level);
            let center = corner.map(|c| (f64::from(c) + half) * side);
            let center = camera_from_world.transform_point(center).map(|c| c as f32);
            // A cube that a rough range does not settle is divided, and its blocks are judged exactly.
            let is_rough = level > 0;
            let verdict = self.judge_ball(center, radius * (1_u32 << level) as f32, is_rough);
            if verdict == BlockVerdict::Nothing {
                continue;
            }
            if level == 0 {
                let is_whole = verdict == BlockVerdict::All;
                self.found.push(FoundBlock { place: corner, center, is_whole });
                continue;
            }
            for child in 0..8 {
                let step = [child & 1, child >> 1 & 1, child >> 2].map(|far| far << (level - 1));
                let corner = [0, 1, 2].map(|axis| corner[axis] + step[axis]);
                if (0..3).all(|axis| corner[axis] <= high[axis]) {
                    self.cubes.push((corner, level - 1));
                }
            }
        }
    }

    /// Side of a cell, metres.
    pub(crate) fn cell_size(&self) -> f64 {
        self.cell_size
    }

    fn block_side(&self) -> f64 {
        self.cell_size * BLOCK_SIDE as f64
    }

    /// Radius of the ball around a block.
    fn block_radius(&self) -> f32 {
        (self.block_side() * 0.75_f64.sqrt()) as f32
    }

    /// The sensor.
    pub(crate) fn sensor(&self) -> &SensorModel {
        &self.sensor
    }

    /// How far beyond a cell at depth `z` a reading must lie to have looked through it.
    pub(crate) fn tolerance(&self, z: f32) -> f32 {
        self.sensor.tolerance(z, self.place_sigma) as f32
    }

    /// Compares a ball around blocks as a whole with the readings in its footprint; `is_rough`: with those in
    /// the large tiles that it touches, where it is large.
    fn judge_ball(&self, [x, y, z]: [f32; 3], radius: f32, is_rough: bool) -> BlockVerdict {
        let View { fx, fy, cx, cy, .. } = self.view;
        let (nearest, farthest) = (z - radius, z + radius);
        let SensorModel { min_depth, max_depth, .. } = self.sensor;
        if farthest < min_depth || nearest > max_depth {
            return BlockVerdict::Nothing;
        }
        if nearest < min_depth.max(NEAREST) {
            let is_beside = |[low, high]: [f32; 2], offset: f32| {
                let outside = |slope: f32, side: f32| {
                    side * (offset - slope * z) > radius * (1.0 + slope * slope).sqrt()
                };
                outside(low, -1.0) || outside(high, 1.0)
            };
            let [columns, rows] = self.view.slopes;
            let is_out_of_view = is_beside(columns, x) || is_beside(rows, y);
            return if is_out_of_view { BlockVerdict::Nothing } else { BlockVerdict::Mixed };
        }
        // |u' - u| of a point within the radius is at most f radius (1 + |x| / z) / nearest.
        let span = |focal: f32, center: f32, offset: f32| {
            let middle = focal * offset / z + center;
            let reach = focal.abs() * radius / nearest * (1.0 + (offset / z).abs());
            [middle - reach, middle + reach]
        };
        let (columns, rows) = (span(fx, cx, x), span(fy, cy, y));
        let tiles = &self.tiles;
        let range = if is_rough { tiles.rough_range(columns, rows) } else { tiles.range(columns, rows) };
        let Some(range) = range else {
            return BlockVerdict::Nothing;
        };
        if range.farthest <= nearest + self.tolerance(nearest) {
            BlockVerdict::Nothing
        } else if farthest <= max_depth && range.nearest > farthest + self.tolerance(farthest) {
            BlockVerdict::All
        } else {
            BlockVerdict::Mixed
        }
    }

    /// The cells of the block at `center` (camera frame) that the current frame looks through.
    fn cells_looked_through(&mut self, center: [f32; 3], depth: &DepthImage) -> CellBits {
        self.project_cells(center);
        let (width, height) = (depth.width(), depth.height());
        let mut cells = CellBits::default();
        for index in 0..BLOCK_CELLS {
            // A negative column or row becomes a huge one.
            let (column, row) = (self.samples.column[index] as usize, self.samples.row[index] as usize);
            let looked_through = column < width
                && row < height
                && depth.data()[row * width + column] > self.samples.far_enough[index];
            cells[index / 64] |= u64::from(looked_through) << (index % 64);
        }
        cells
    }

    /// Projects all cells of the block at `center` (camera frame).
    fn project_cells(&mut self, center: [f32; 3]) {
        let View { fx, fy, cx, cy, .. } = self.view;
        let SensorModel { min_depth, max_depth, .. } = self.sensor;
        // The tolerance is convex in the depth, and nearly linear over a block.
        let radius = self.block_radius();
        let (before, behind) = (self.tolerance(center[2] - radius), self.tolerance(center[2] + radius));
        let (slope, middle) = (0.5 * (behind - before) / radius, 0.5 * (before + behind));
        let limit = ROUNDING_LIMIT as f32;
        let samples = &mut *self.samples;
        let [offset_x, offset_y, offset_z] = &samples.offsets;
        for index in 0..BLOCK_CELLS {
            let z = center[2] + offset_z[index];
            // A cell before or behind the mapped range of depth is never looked through.
            let in_range = z >= min_depth && z <= max_depth;
            let far_enough = z + middle + slope * offset_z[index];
            samples.far_enough[index] = if in_range { far_enough } else { f32::INFINITY };
            let inverse = 1.0 / z.max(1e-3);
            let u = fx * (center[0] + offset_x[index]) * inverse + cx;
            let v = fy * (center[1] + offset_y[index]) * inverse + cy;
            samples.column[index] = round_to_i32(u.clamp(-limit, limit));
            samples.row[index] = round_to_i32(v.clamp(-limit, limit));
        }
    }
}

impl CellSamples {
    /// Places the cells of a block around its centre for a camera's orientation.
    fn place_cells(&mut self, camera_from_world: &Pose, cell_size: f64) {
        let middle = (BLOCK_SIDE as f64 - 1.0) / 2.0;
        for index in 0..BLOCK_CELLS {
            let offset = cell_in_block(index).map(|c| (f64::from(c) - middle) * cell_size);
            let offset = camera_from_world.rotate(offset);
            for (axis, place) in self.offsets.iter_mut().zip(offset) {
                axis[index] = place as f32;
            }
        }
    }
}

impl Default for CellSamples {
    fn default() -> Self {
        Self {
            offsets: [[0.0; BLOCK_CELLS]; 3],
            far_enough: [0.0; BLOCK_CELLS],
            column: [0; BLOCK_CELLS],
            row: [0; BLOCK_CELLS],
        }
    }
}

/// Block coordinates of the box around what the camera sees up to `max_depth`: lowest and highest.
fn blocks_around_view(
    camera: &PinholeCamera,
    world_from_camera: &Pose,
    max_depth: f32,
    block_side: f64,
) -> [[i32; 3]; 2] {
    let (right, bottom) = (camera.width() as f64 - 0.5, camera.height() as f64 - 0.5);
    let mut low = world_from_camera.translation();
    let mut high = low;
    for pixel in [[-0.5, -0.5], [right, -0.5], [-0.5, bottom], [right, bottom]] {
        let corner = world_from_camera.transform_point(camera.back_project(pixel, f64::from(max_depth)));
        for axis in 0..3 {
            low[axis] = low[axis].min(corner[axis]);
            high[axis] = high[axis].max(corner[axis]);
        }
    }
    [low, high].map(|corner| corner.map(|c| (c / block_side).floor() as i32))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn blocks_behind_what_is_seen_cost_nothing_and_none_before_is_missed() {
        let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5).unwrap();
        let sensor = SensorModel { max_depth: 80.0, ..SensorModel::kinect() };
        let turn = Pose::new([0.3, -0.2, 0.1], [0.1, 0.2, 0.3, 0.927_361_849_549_570_4]).unwrap();
        // A wall at 3 m, farther through a door.
        let wall = |pixel: usize| if (60..80).contains(&(pixel % 160)) { 9.0 } else { 3.0 };
        let depth = DepthImage::new(160, 120, (0..160 * 120).map(wall).collect()).unwrap();
        let mut look = LookThrough::new(0.04, sensor);
        look.take_view(&camera, &depth, &turn);
        look.find_blocks();
        let mut found: Vec<[i32; 3]> = look.found.iter().map(|block| block.place).collect();
        let looked_through = |look: &mut LookThrough, place: [i32; 3]| {
            let center = turn.inverse().transform_point(place.map(|c| (f64::from(c) + 0.5) * 0.32));
            look.cells_looked_through(center.map(|c| c as f32), &depth) != CellBits::default()
        };
        assert!(found.len() < 10_000, "{} of 15 million", found.len());
        assert!(found.iter().filter(|&&place| looked_through(&mut look, place)).count() > 1000);
        found.sort_unstable();
        for index in 0..64 * 64 * 64 {
            let place = [index % 64, index / 64 % 64, index / 4096].map(|c| c - 32);
            let is_in =
                (0..3).all(|axis| (look.view.low[axis]..=look.view.high[axis]).contains(&place[axis]));
            if is_in && looked_through(&mut look, place) {
                assert!(found.binary_search(&place).is_ok(), "{place:?}");
            }
        }
    }

    #[test]
    fn blocks_looked_through_as_a_whole_are_so_cell_by_cell() {
        // No side of the image is a multiple of a tile's.
        let camera = PinholeCamera::new(170, 100, 130.0, 130.0, 84.5, 49.5).unwrap();
        let turn = Pose::new([0.3, -0.2, 0.1], [0.1, 0.2, 0.3, 0.927_361_849_549_570_4]).unwrap();
        // Steps, and columns without a reading.
        let depth = |pixel: usize| [4.4, 1.9, 0.0, 2.2, 4.4][pixel % 170 / 34] + (pixel / 170) as f32 / 500.0;
        let depth = DepthImage::new(170, 100, (0..170 * 100).map(depth).collect()).unwrap();
        let mut look = LookThrough::new(0.01, SensorModel::kinect());
        look.take_view(&camera, &depth, &turn);
        look.find_blocks();
        let whole: Vec<FoundBlock> = look.found.iter().filter(|block| block.is_whole).copied().collect();
        assert!(whole.len() > 1000, "{}", whole.len());
        for block in whole {
            let cells = look.cells_looked_through(block.center, &depth);
            assert_eq!(cells, [u64::MAX; BLOCK_CELLS / 64], "{block:?}");
        }
    }
}
