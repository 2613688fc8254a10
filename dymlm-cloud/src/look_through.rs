use dymlm_core::{DepthImage, PinholeCamera, Pose, SensorModel};

use crate::block_store::{BLOCK_CELLS, BLOCK_SIDE, CellBits, cell_in_block};
use crate::depth_tiles::DepthTiles;
use crate::rounding::{ROUNDING_LIMIT, round_to_i32};

/// Tells which cells a frame looks through.
///
/// A frame looks through a cell when the reading at the cell's centre lies beyond it by more than the
/// sensor's tolerance ([`Visibility::Absent`](dymlm_core::Visibility::Absent)), whatever it is a reading of:
/// also somebody who walks behind a place shows that the place is free.
///
/// Cost a frame: one look at the image for each block of 8^3 cells in view, and one for each cell of the
/// blocks that neither lie wholly before the readings nor wholly behind; independent of the number of frames
/// before.
#[derive(Debug, Clone)]
pub(crate) struct LookThrough {
    cell_size: f64,
    sensor: SensorModel,
    /// How well a cell's centre tells where a surface in it is, metres: half the cell's diagonal.
    place_sigma: f64,
    view: View,
    tiles: DepthTiles,
    samples: Box<CellSamples>,
}

/// What a frame looks through in a block.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum LookedThrough {
    All,
    Cells(CellBits),
}

/// Where the current frame was seen from.
#[derive(Debug, Clone, Copy, Default)]
struct View {
    fx: f32,
    fy: f32,
    cx: f32,
    cy: f32,
    camera_from_world: Pose,
    /// Lowest and highest block coordinates around what is seen.
    low: [i32; 3],
    high: [i32; 3],
}

/// Where the cells of one block lie in the image.
#[derive(Debug, Clone)]
struct CellSamples {
    /// Cell centres relative to the block's centre, in the camera's frame, metres; one array an axis.
    offsets: [[f32; BLOCK_CELLS]; 3],
    /// A reading must lie beyond this to look through the cell.
    far_enough: [f32; BLOCK_CELLS],
    /// The pixel at which the cell's centre appears.
    column: [i32; BLOCK_CELLS],
    row: [i32; BLOCK_CELLS],
}

/// What one look at a block's whole footprint says.
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
        }
    }

    /// Makes a frame the current one.
    pub(crate) fn take_view(&mut self, camera: &PinholeCamera, depth: &DepthImage, world_from_camera: &Pose) {
        let block_side = self.block_side();
        let [low, high] = blocks_around_view(camera, world_from_camera, self.sensor.max_depth, block_side);
        self.view = View {
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
        let View { low, high, camera_from_world, .. } = self.view;
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let center = [x, y, z].map(|c| (f64::from(c) + 0.5) * self.block_side());
                    let center = camera_from_world.transform_point(center).map(|c| c as f32);
                    match self.judge_block(center) {
                        BlockVerdict::Nothing => {}
                        BlockVerdict::All => count([x, y, z], LookedThrough::All),
                        BlockVerdict::Mixed => {
                            let cells = self.cells_looked_through(center, depth);
                            if cells != CellBits::default() {
                                count([x, y, z], LookedThrough::Cells(cells));
                            }
                        }
                    }
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

    /// How far beyond a cell at depth `z` a reading must lie to have looked through it.
    fn tolerance(&self, z: f32) -> f32 {
        self.sensor.tolerance(z, self.place_sigma) as f32
    }

    /// Compares the block's ball as a whole with the readings around it.
    fn judge_block(&self, [x, y, z]: [f32; 3]) -> BlockVerdict {
        let radius = self.block_radius();
        let View { fx, fy, cx, cy, .. } = self.view;
        let (nearest, farthest) = (z - radius, z + radius);
        let SensorModel { min_depth, max_depth, .. } = self.sensor;
        if farthest < min_depth || nearest > max_depth {
            return BlockVerdict::Nothing;
        }
        if nearest < min_depth.max(0.05) {
            return BlockVerdict::Mixed;
        }
        // |u' - u| of a point within the radius is at most f radius (1 + |x| / z) / nearest.
        let span = |focal: f32, center: f32, offset: f32| {
            let middle = focal * offset / z + center;
            let reach = focal.abs() * radius / nearest * (1.0 + (offset / z).abs());
            [middle - reach, middle + reach]
        };
        let Some(range) = self.tiles.range(span(fx, cx, x), span(fy, cy, y)) else {
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
        // The tolerance is convex in the depth, and over a block next to straight.
        let radius = self.block_radius();
        let (before, behind) = (self.tolerance(center[2] - radius), self.tolerance(center[2] + radius));
        let (slope, middle) = (0.5 * (behind - before) / radius, 0.5 * (before + behind));
        let limit = ROUNDING_LIMIT as f32;
        let samples = &mut *self.samples;
        let [offset_x, offset_y, offset_z] = &samples.offsets;
        for index in 0..BLOCK_CELLS {
            let z = center[2] + offset_z[index];
            // A cell before or behind the mapped range is never looked through.
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
