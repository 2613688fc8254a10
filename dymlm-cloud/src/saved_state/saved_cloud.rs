use super::Head;
use super::saved_blocks::SavedBlocks;
use crate::CloudMap;

/// What must be known of a state of a map that was saved, so that only what has changed since is saved
/// [next](CloudMap::save_state): which blocks it had, and in which versions. A clone of the map would keep what
/// was in them, which changes while mapping goes on: the memory of the map once more.
#[derive(Debug)]
pub struct SavedCloud {
    pub(super) voxels: SavedBlocks,
    pub(super) evidence: SavedBlocks,
    pub(super) head: Head,
}

impl CloudMap {
    /// This state of the map as one that was saved. O(blocks).
    pub fn to_saved(&self) -> SavedCloud {
        SavedCloud {
            voxels: SavedBlocks::of(&self.voxels),
            evidence: SavedBlocks::of(self.evidence.blocks()),
            head: self.head(),
        }
    }
}

impl SavedCloud {
    /// Approximate bytes that it holds.
    pub fn memory_bytes(&self) -> usize {
        self.voxels.memory_bytes() + self.evidence.memory_bytes()
    }
}
