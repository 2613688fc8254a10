use std::ops::RangeInclusive;

use super::voxel_box::VoxelBox;
use crate::shared_map::SharedMap;

/// Voxels along the side of a block, as a power of two: 16, 0.4 m at 2.5 cm. A block holds some hundred
/// voxels of a plane.
const BLOCK_BITS: u32 = 4;
/// Voxels in a block.
pub(super) const BLOCK_VOXELS: usize = 1 << (3 * BLOCK_BITS);
/// Bits of a block's coordinate in a key.
const BITS: u32 = 17;
const HALF: i32 = 1 << (BITS - 1);
/// Largest coordinate of a voxel along each axis, in voxels from the origin.
pub(super) const REACH: i32 = (HALF << BLOCK_BITS) - 1;

/// The coordinates of a block, or of a larger cell, in one number; ordered by x, y, z.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct BlockKey(u64);

impl BlockKey {
    /// The key of a cell's coordinates.
    pub(super) fn new(cell: [i32; 3]) -> Self {
        let part = |c: i32| (c.clamp(-HALF, HALF - 1) + HALF) as u64;
        Self(cell.iter().fold(0, |key, &c| key << BITS | part(c)))
    }

    /// The block of a voxel.
    pub(crate) fn of(voxel: [i32; 3]) -> Self {
        Self::new(cell_of(voxel))
    }

    pub(super) fn cell(self) -> [i32; 3] {
        let mask = (1_u64 << BITS) - 1;
        [2 * BITS, BITS, 0].map(|shift| ((self.0 >> shift) & mask) as i32 - HALF)
    }

    /// The number, of 51 bits, of the cube of 8 blocks a side that contains the block.
    #[cfg(feature = "state")]
    pub(crate) fn cube(self) -> u64 {
        Self::new(self.cell().map(|c| c >> 3)).0
    }

    /// Whether it is a valid key of a block.
    #[cfg(feature = "state")]
    pub(super) fn is_possible(self) -> bool {
        self == Self::new(self.cell())
    }

    /// The voxels of the block.
    pub(crate) fn voxels(self) -> VoxelBox {
        let min = self.cell().map(|c| c << BLOCK_BITS);
        VoxelBox { min, max: min.map(|c| c + (1 << BLOCK_BITS) - 1) }
    }

    /// Centre and radius of the sphere around the block, metres.
    pub(crate) fn sphere(self, voxel_size: f64) -> ([f64; 3], f64) {
        let side = f64::from(1 << BLOCK_BITS) * voxel_size;
        (self.cell().map(|c| (f64::from(c) + 0.5) * side), 0.5 * 3.0_f64.sqrt() * side)
    }
}

/// The coordinates of a voxel's block.
pub(super) fn cell_of(voxel: [i32; 3]) -> [i32; 3] {
    voxel.map(|c| c >> BLOCK_BITS)
}

/// A voxel's place in its block.
pub(super) fn local(voxel: [i32; 3]) -> u16 {
    voxel.iter().fold(0, |place, c| place << BLOCK_BITS | (c & ((1 << BLOCK_BITS) - 1)) as u16)
}

/// The voxel at a place in a block.
pub(super) fn voxel_at(block: BlockKey, local: u16) -> [i32; 3] {
    let min = block.voxels().min;
    let part = |axis: u32| i32::from(local >> ((2 - axis) * BLOCK_BITS)) & ((1 << BLOCK_BITS) - 1);
    [min[0] + part(0), min[1] + part(1), min[2] + part(2)]
}

/// Calls `visit` for each entry of `cells` (keyed by cells of 2^bits blocks a side) whose cell a box of
/// voxels touches, in the order of the keys. O(columns of cells in the box, or all entries if these are
/// fewer).
pub(super) fn visit_in<'a, T: Clone>(
    cells: &'a SharedMap<BlockKey, T>,
    region: &VoxelBox,
    bits: u32,
    mut visit: impl FnMut(BlockKey, &'a T),
) {
    if region.is_empty() || cells.is_empty() {
        return;
    }
    let region = region.coarse(BLOCK_BITS + bits);
    if region.columns() >= cells.len() as u64 {
        cells.iter().filter(|(key, _)| region.contains(key.cell())).for_each(|(&key, held)| visit(key, held));
        return;
    }
    for x in region.min[0]..=region.max[0] {
        for y in region.min[1]..=region.max[1] {
            let column: RangeInclusive<BlockKey> =
                BlockKey::new([x, y, region.min[2]])..=BlockKey::new([x, y, region.max[2]]);
            cells.range(column).for_each(|(&key, held)| visit(key, held));
        }
    }
}
