use dymlm_core::{DepthImage, PinholeCamera, Pose};

use super::EvidenceConfig;
use super::block_store::{BLOCK_CELLS, BLOCK_SIDE, BlockKey, BlockStore, cell_in_block, split};
use super::depth_tiles::DepthTiles;
use super::rounding::{ROUNDING_LIMIT, round_to_i32};

/// For and against each place being static: how many frames have read a surface there, and how many have looked
/// through it, over all frames, whether before or after something was mapped there.
///
/// A frame looks through a cell when the reading at the cell's centre lies beyond it by more than the margin. Counts
/// are integers and each frame adds to each cell at most once, a surface winning over a look through, so the
/// evidence does not depend on the order of the frames, and a frame can be taken out again.
///
/// This is the idea of Dynablox (Schmid 2023) and DUFOMap (Duberg 2024), movers betray themselves by having been in
/// free space, with counts in place of their clocks.
///
/// Cost a frame: one look at the image for each block of 8^3 cells in view, and one for each cell of the blocks that
/// neither lie wholly before the readings nor wholly behind; independent of the number of frames before.
#[derive(Debug, Clone)]
pub(super) struct Evidence {
    /// A cell has 2^`cell_shift` voxels along its side.
    cell_shift: u32,
    cell_size: f64,
    margin: f32,
    margin_per_depth: f32,
    depth_range: [f32; 2],
    blocks: BlockStore<EvidenceBlock>,
    /// Slots of blocks with a cell read by the current frame.
    read_blocks: Vec<usize>,
    /// The block read last, and its slot.
    last_read: Option<(BlockKey, usize)>,
    tiles: DepthTiles,
    samples: Box<CellSamples>,
}

/// A bit for each cell of a block.
pub(super) type CellBits = [u64; BLOCK_CELLS / 64];

#[derive(Debug, Clone, Default)]
pub(super) struct EvidenceBlock {
    /// Frames that look through all of the block; in addition to what the cells count.
    looked_through: u32,
    /// All cells, or none as long as no cell differs from the others.
    cells: Vec<Support>,
    /// The cells that the current frame has read, and whether there are any.
    read: CellBits,
    is_read: bool,
}

/// How many frames speak for and against a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Support {
    /// Frames that read a surface there.
    pub support: u32,
    /// Frames that looked through.
    pub looked_through: u32,
}

/// Whether a frame is put in or taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Direction {
    Insert,
    Remove,
}

impl Direction {
    /// +1 or -1 for wrapping counters.
    #[inline]
    pub(super) fn unit(self) -> u32 {
        match self {
            Self::Insert => 1,
            Self::Remove => 1_u32.wrapping_neg(),
        }
    }
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

/// A frame as the evidence sees it: everything that stays the same from block to block.
struct View<'a> {
    fx: f32,
    fy: f32,
    cx: f32,
    cy: f32,
    depth: &'a DepthImage,
    tiles: &'a DepthTiles,
    camera_from_world: Pose,
    block_radius: f32,
    depth_range: [f32; 2],
    /// A cell at depth z is looked through by readings beyond `scale * z + margin`.
    scale: f32,
    margin: f32,
    unit: u32,
}

/// What one look at a block's whole footprint says.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum BlockVerdict {
    NothingLookedThrough,
    AllLookedThrough,
    Mixed,
}

impl Evidence {
    pub(super) fn new(config: &EvidenceConfig, voxel_size: f64, depth_range: [f32; 2]) -> Self {
        let cell_shift = (config.cell_size / voxel_size).log2().round().clamp(0.0, 10.0) as u32;
        Self {
            cell_shift,
            cell_size: voxel_size * f64::from(1_u32 << cell_shift),
            margin: config.margin as f32,
            margin_per_depth: config.margin_per_depth as f32,
            depth_range,
            blocks: BlockStore::default(),
            read_blocks: Vec::new(),
            last_read: None,
            tiles: DepthTiles::default(),
            samples: Box::default(),
        }
    }

    /// Notes that the current frame has read a surface in `voxel`.
    #[inline]
    pub(super) fn read(&mut self, voxel: [i32; 3]) {
        let (block, index) = self.cell_of(voxel);
        let key = BlockKey::new(block);
        // Neighbouring readings mostly share a block.
        let slot = match self.last_read {
            Some((last_key, slot)) if last_key == key => slot,
            _ => self.blocks.slot_or_insert(key),
        };
        self.last_read = Some((key, slot));
        if let Some(block) = self.blocks.blocks_mut().get_mut(slot) {
            if !block.is_read {
                block.is_read = true;
                self.read_blocks.push(slot);
            }
            block.read[index / 64] |= 1 << (index % 64);
        }
    }

    /// Counts the frame whose readings have been noted: what it looks through, then what it has read.
    pub(super) fn count_frame(
        &mut self,
        camera: &PinholeCamera,
        depth: &DepthImage,
        world_from_camera: &Pose,
        direction: Direction,
    ) {
        self.tiles.build(depth);
        self.count_looked_through(camera, depth, world_from_camera, direction);
        self.count_support(direction);
    }

    /// Block coordinates and index in its block of the cell that holds a voxel.
    #[inline]
    pub(super) fn cell_of(&self, voxel: [i32; 3]) -> ([i32; 3], usize) {
        split(voxel.map(|c| c >> self.cell_shift))
    }

    pub(super) fn blocks(&self) -> &BlockStore<EvidenceBlock> {
        &self.blocks
    }

    /// Adds another map's evidence.
    pub(super) fn merge(&mut self, other: &Self) {
        for (key, theirs) in other.blocks.keys().iter().zip(other.blocks.blocks()) {
            let slot = self.blocks.slot_or_insert(*key);
            if let Some(block) = self.blocks.blocks_mut().get_mut(slot) {
                block.looked_through = block.looked_through.wrapping_add(theirs.looked_through);
                for (index, cell) in theirs.cells.iter().enumerate() {
                    let ours = &mut block.cells_mut()[index];
                    ours.support = ours.support.wrapping_add(cell.support);
                    ours.looked_through = ours.looked_through.wrapping_add(cell.looked_through);
                }
            }
        }
    }

    pub(super) fn memory_bytes(&self) -> usize {
        let cells: usize = self.blocks.blocks().iter().map(|block| block.cells.capacity()).sum();
        self.blocks.memory_bytes() + cells * size_of::<Support>()
    }

    fn count_looked_through(
        &mut self,
        camera: &PinholeCamera,
        depth: &DepthImage,
        world_from_camera: &Pose,
        direction: Direction,
    ) {
        let block_side = self.cell_size * BLOCK_SIDE as f64;
        let view = View {
            fx: camera.fx() as f32,
            fy: camera.fy() as f32,
            cx: camera.cx() as f32,
            cy: camera.cy() as f32,
            depth,
            tiles: &self.tiles,
            camera_from_world: world_from_camera.inverse(),
            block_radius: (block_side * 0.75_f64.sqrt()) as f32,
            depth_range: self.depth_range,
            scale: 1.0 + self.margin_per_depth,
            margin: self.margin,
            unit: direction.unit(),
        };
        self.samples.place_cells(&view.camera_from_world, self.cell_size);
        let [low, high] = blocks_around_view(camera, world_from_camera, self.depth_range[1], block_side);
        for z in low[2]..=high[2] {
            for y in low[1]..=high[1] {
                for x in low[0]..=high[0] {
                    let center = [x, y, z].map(|c| (f64::from(c) + 0.5) * block_side);
                    let center = view.camera_from_world.transform_point(center).map(|c| c as f32);
                    view.count_block(center, BlockKey::new([x, y, z]), &mut self.blocks, &mut self.samples);
                }
            }
        }
    }

    fn count_support(&mut self, direction: Direction) {
        let unit = direction.unit();
        for slot in self.read_blocks.drain(..) {
            let Some(block) = self.blocks.blocks_mut().get_mut(slot) else { continue };
            let read = std::mem::take(&mut block.read);
            block.is_read = false;
            let cells = block.cells_mut();
            for (word, mut bits) in read.into_iter().enumerate() {
                while bits != 0 {
                    let cell = &mut cells[word * 64 + bits.trailing_zeros() as usize];
                    cell.support = cell.support.wrapping_add(unit);
                    bits &= bits - 1;
                }
            }
        }
    }
}

impl EvidenceBlock {
    fn cells_mut(&mut self) -> &mut [Support] {
        if self.cells.is_empty() {
            self.cells = vec![Support::default(); BLOCK_CELLS];
        }
        &mut self.cells
    }

    /// The evidence of the cell with this index.
    #[inline]
    pub(super) fn at(&self, index: usize) -> Support {
        let cell = self.cells.get(index).copied().unwrap_or_default();
        Support { looked_through: cell.looked_through.wrapping_add(self.looked_through), ..cell }
    }

    /// Whether a surface may have been read in it.
    #[inline]
    pub(super) fn may_be_supported(&self) -> bool {
        !self.cells.is_empty()
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

    /// Projects all cells of the block at `center` (camera frame).
    fn project(&mut self, view: &View<'_>, center: [f32; 3]) {
        let [near, far] = view.depth_range;
        let [offset_x, offset_y, offset_z] = &self.offsets;
        for index in 0..BLOCK_CELLS {
            let z = center[2] + offset_z[index];
            // A cell before or behind the mapped range is never looked through.
            let in_range = z >= near && z <= far;
            self.far_enough[index] = if in_range { view.scale * z + view.margin } else { f32::INFINITY };
            let inverse = 1.0 / z.max(1e-3);
            let u = view.fx * (center[0] + offset_x[index]) * inverse + view.cx;
            let v = view.fy * (center[1] + offset_y[index]) * inverse + view.cy;
            self.column[index] = round_to_i32(u.clamp(-ROUNDING_LIMIT, ROUNDING_LIMIT));
            self.row[index] = round_to_i32(v.clamp(-ROUNDING_LIMIT, ROUNDING_LIMIT));
        }
    }
}

impl View<'_> {
    fn count_block(
        &self,
        center: [f32; 3],
        key: BlockKey,
        blocks: &mut BlockStore<EvidenceBlock>,
        samples: &mut CellSamples,
    ) {
        let verdict = self.judge_block(center);
        if verdict == BlockVerdict::NothingLookedThrough {
            return;
        }
        let read = blocks.get(key).filter(|block| block.is_read).map(|block| block.read);
        if verdict == BlockVerdict::AllLookedThrough && read.is_none() {
            let slot = blocks.slot_or_insert(key);
            if let Some(block) = blocks.blocks_mut().get_mut(slot) {
                block.looked_through = block.looked_through.wrapping_add(self.unit);
            }
            return;
        }
        samples.project(self, center);
        self.count_cells(samples, &read.unwrap_or_default(), key, blocks);
    }

    /// Compares the block's ball as a whole with the readings around it.
    fn judge_block(&self, [x, y, z]: [f32; 3]) -> BlockVerdict {
        let radius = self.block_radius;
        let (nearest, farthest) = (z - radius, z + radius);
        let [min_depth, max_depth] = self.depth_range;
        if farthest < min_depth || nearest > max_depth {
            return BlockVerdict::NothingLookedThrough;
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
        let Some(range) = self.tiles.range(span(self.fx, self.cx, x), span(self.fy, self.cy, y)) else {
            return BlockVerdict::NothingLookedThrough;
        };
        if range.farthest <= self.scale * nearest + self.margin {
            BlockVerdict::NothingLookedThrough
        } else if farthest <= max_depth && range.nearest > self.scale * farthest + self.margin {
            BlockVerdict::AllLookedThrough
        } else {
            BlockVerdict::Mixed
        }
    }

    fn count_cells(
        &self,
        samples: &CellSamples,
        read: &CellBits,
        key: BlockKey,
        blocks: &mut BlockStore<EvidenceBlock>,
    ) {
        let (width, height) = (self.depth.width(), self.depth.height());
        let mut slot = None;
        for index in 0..BLOCK_CELLS {
            // A negative column or row becomes a huge one.
            let (column, row) = (samples.column[index] as usize, samples.row[index] as usize);
            let looked_through = column < width
                && row < height
                && self.depth.data()[row * width + column] > samples.far_enough[index]
                && read[index / 64] >> (index % 64) & 1 == 0;
            if looked_through {
                let slot = *slot.get_or_insert_with(|| blocks.slot_or_insert(key));
                if let Some(block) = blocks.blocks_mut().get_mut(slot) {
                    let cell = &mut block.cells_mut()[index];
                    cell.looked_through = cell.looked_through.wrapping_add(self.unit);
                }
            }
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
