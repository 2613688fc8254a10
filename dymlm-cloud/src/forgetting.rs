use dymlm_core::vector3::distances_to_box;

use crate::CloudMap;
use crate::block_store::BlockKey;

impl CloudMap {
    /// Forgets everything that is farther than `radius` metres from a place (world), by whole blocks of the
    /// evidence (8 cells of some 4 cm a side): their voxels, and all that frames said of them. The rest stays
    /// as it was.
    ///
    /// Frames that reach farther can no longer be [removed](CloudMap::remove). O(blocks held); only what is
    /// near the border is judged anew.
    pub fn forget_outside(&mut self, center: [f64; 3], radius: f64) {
        let cell_size = self.evidence.cell_size();
        self.forget_blocks(|key| distances_to_box(center, key.bounds(cell_size))[0] > radius);
    }

    /// Forgets the blocks that the frame taken out last has left without any count: else whoever takes frames
    /// out as they grow old would keep a block of each place that was ever seen.
    pub(crate) fn drop_void_blocks(&mut self) {
        let mut void: Vec<BlockKey> = self.evidence.void_blocks();
        // What a body has left or brought may have voxels all the same.
        void.retain(|&key| {
            let (first, side) = self.evidence.voxel_blocks_over(key);
            let mut is_empty = true;
            self.voxels.slots_within(first, side, |slot| {
                is_empty &= self.voxels.blocks()[slot].look().len() == 0;
            });
            is_empty
        });
        if !void.is_empty() {
            void.sort_unstable();
            self.forget_blocks(|key| void.binary_search(&key).is_ok());
        }
    }

    /// Forgets blocks of the evidence, and the voxels in them.
    fn forget_blocks(&mut self, is_forgotten: impl Fn(BlockKey) -> bool) {
        let Some(cells) = self.evidence.forget(is_forgotten) else { return };
        let evidence = &self.evidence;
        let stays = |key: BlockKey| evidence.slot_of(key.cell(0)).is_some();
        let blocks = self.voxels.keys().iter().zip(self.voxels.blocks().iter());
        // What stays is not looked into: most of it may be in a file.
        let gone: usize = blocks.filter(|(key, _)| !stays(**key)).map(|(_, block)| block.look().len()).sum();
        self.voxel_count = self.voxel_count.saturating_sub(gone);
        let voxels = self.voxels.retain(stays);
        let voxels_stay = voxels.as_ref().map(|voxels| voxels.stays.as_slice());
        self.kept.forget(&cells, voxels_stay, self.voxels.bounds());
        let (stamp, seen) = (self.next_stamp(), self.kept.stamp());
        for slot in voxels.into_iter().flat_map(|voxels| voxels.around) {
            if let Some(block) = self.voxels.begin_change(slot, stamp, seen) {
                // Heavier voxels beside it may be gone.
                block.lowered = stamp;
            }
        }
    }
}
