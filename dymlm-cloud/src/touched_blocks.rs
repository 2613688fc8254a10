use crate::block_store::{BlockKey, BlockStore, CellBits};
use crate::voxel_block::VoxelBlock;

/// The blocks of voxels that a frame touches. While the frame is added they are kept here instead of at their
/// slots, where each access would check anew whether a clone of the map shares them.
#[derive(Debug, Default)]
pub(crate) struct TouchedBlocks {
    blocks: Vec<TouchedBlock>,
}

#[derive(Debug, Clone)]
pub(crate) struct TouchedBlock {
    pub(crate) slot: usize,
    pub(crate) block: VoxelBlock,
    /// The voxels that the frame has read.
    pub(crate) read: CellBits,
}

/// A clone begins empty: what a frame has touched is only needed right after it.
impl Clone for TouchedBlocks {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl TouchedBlocks {
    /// Begins a frame; all blocks are at their slots.
    pub(crate) fn clear(&mut self) {
        self.blocks.clear();
    }

    /// The number here of the block at `key`, made when there is none; at its first touch the block is taken
    /// from its slot. `stamp` is the frame's; the static cloud knows what changed before `seen`.
    #[inline]
    pub(crate) fn touch(
        &mut self,
        voxels: &mut BlockStore<VoxelBlock>,
        key: BlockKey,
        stamp: u32,
        seen: u32,
    ) -> u32 {
        let slot = voxels.slot_or_insert(key);
        match voxels.blocks().get(slot) {
            Some(there) if there.stamp == stamp => there.touched,
            _ => self.take_out(voxels, slot, stamp, seen),
        }
    }

    #[cold]
    fn take_out(&mut self, voxels: &mut BlockStore<VoxelBlock>, slot: usize, stamp: u32, seen: u32) -> u32 {
        let number = self.blocks.len() as u32;
        let mut block = VoxelBlock::default();
        if let Some(there) = voxels.begin_change(slot, stamp, seen) {
            std::mem::swap(there, &mut block);
            (there.stamp, there.touched) = (stamp, number);
        }
        self.blocks.push(TouchedBlock { slot, block, read: CellBits::default() });
        number
    }

    pub(crate) fn get_mut(&mut self, number: u32) -> Option<&mut TouchedBlock> {
        self.blocks.get_mut(number as usize)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &TouchedBlock> {
        self.blocks.iter()
    }

    /// Puts the blocks back at their slots.
    pub(crate) fn put_back(&mut self, voxels: &mut BlockStore<VoxelBlock>) {
        for touched in &mut self.blocks {
            if let Some(there) = voxels.block_mut(touched.slot) {
                std::mem::swap(there, &mut touched.block);
            }
        }
    }
}
