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
        let Some(cells) = self.evidence.forget(|block| distances_to_box(center, block)[0] > radius) else {
            return;
        };
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
