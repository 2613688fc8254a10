use dymlm_core::Birth;

use super::block::{BlockKey, visit_in};
use super::voxel_box::VoxelBox;
use crate::shared_map::SharedMap;

/// Blocks along the side of a cell, as a power of two: 4, 1.6 m at 2.5 cm. A frame's view touches some dozens
/// of cells.
const CELL_BITS: u32 = 2;

/// Spatial index of planes by their voxels, so that a query for what is near visits no other planes.
#[derive(Debug, Clone, Default)]
pub(crate) struct PlaneIndex {
    /// The planes in each cell, sorted by birth, with the number of their blocks in it.
    cells: SharedMap<BlockKey, Vec<(Birth, u32)>>,
    /// A box around all blocks that were added since it was shrunk.
    bounds: VoxelBox,
}

impl PlaneIndex {
    fn cell_of(block: BlockKey) -> BlockKey {
        BlockKey::new(block.cell().map(|c| c >> CELL_BITS))
    }

    /// Adds a block of a plane.
    pub(crate) fn add(&mut self, block: BlockKey, plane: Birth) {
        self.bounds = self.bounds.union(&block.voxels());
        let planes = self.cells.get_or_insert_with(Self::cell_of(block), Vec::new);
        match planes.binary_search_by_key(&plane, |(birth, _)| *birth) {
            Ok(place) => planes[place].1 += 1,
            Err(place) => planes.insert(place, (plane, 1)),
        }
    }

    /// Removes a block of a plane.
    pub(crate) fn take(&mut self, block: BlockKey, plane: Birth) {
        let cell = Self::cell_of(block);
        let Some(planes) = self.cells.get_mut(&cell) else { return };
        if let Ok(place) = planes.binary_search_by_key(&plane, |(birth, _)| *birth) {
            planes[place].1 -= 1;
            if planes[place].1 == 0 {
                planes.remove(place);
            }
        }
        if planes.is_empty() {
            self.cells.remove(&cell);
        }
    }

    /// The planes with blocks in the cells that a box of voxels touches, in the order of their births.
    pub(crate) fn near(&self, region: &VoxelBox) -> Vec<Birth> {
        // Room for what is near most regions, so that the list seldom grows.
        let mut found = Vec::with_capacity(64);
        visit_in(&self.cells, region, CELL_BITS, |_, planes| {
            found.extend(planes.iter().map(|(birth, _)| *birth));
        });
        found.sort_unstable();
        found.dedup();
        found
    }

    /// A box around all voxels, and those removed since it was shrunk.
    pub(crate) fn bounds(&self) -> VoxelBox {
        self.bounds
    }

    /// Makes the bounds those of what is left, to a cell. O(cells).
    pub(crate) fn shrink_bounds(&mut self) {
        let block = |cell: &BlockKey, place: i32| {
            BlockKey::new(cell.cell().map(|c| (c << CELL_BITS) + place)).voxels()
        };
        let last = (1 << CELL_BITS) - 1;
        let around = |cell: &BlockKey| block(cell, 0).union(&block(cell, last));
        let left = self.cells.keys().map(around).reduce(|all, own| all.union(&own)).unwrap_or_default();
        self.bounds = self.bounds.intersection(&left);
    }

    /// Extends the bounds by those of a saved index.
    #[cfg(feature = "state")]
    pub(crate) fn restore_bounds(&mut self, bounds: VoxelBox) {
        self.bounds = self.bounds.union(&bounds);
    }

    /// Bytes that another index does not share.
    pub(crate) fn memory_bytes_beside(&self, other: Option<&Self>) -> usize {
        let planes =
            |planes: &Vec<(Birth, u32)>, _: Option<&_>| planes.capacity() * size_of::<(Birth, u32)>();
        self.cells.memory_bytes_beside(other.map(|other| &other.cells), planes)
    }
}
