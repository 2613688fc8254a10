use crate::patches::PatchVoxel;

/// What the evidence says of a plane's voxels in a block.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct Judgement {
    /// Number of voxels of which nothing is known.
    pub(super) unknown: usize,
    /// Places in the block, ascending, of the voxels in free space: what was there is gone.
    free: Vec<u16>,
}

impl Judgement {
    /// The judgement on a block's voxels, in their order. `is_free` tells whether one is in free space; `None`:
    /// unknown. There is none where all of them stand.
    pub(super) fn of(
        voxels: impl Iterator<Item = PatchVoxel>,
        is_free: impl Fn(PatchVoxel) -> Option<bool>,
    ) -> Option<Self> {
        let mut judgement = Self::default();
        for voxel in voxels {
            match is_free(voxel) {
                None => judgement.unknown += 1,
                Some(true) => judgement.free.push(voxel.place_in_block()),
                Some(false) => {}
            }
        }
        (judgement != Self::default()).then_some(judgement)
    }

    /// Whether a voxel of the block is in free space.
    pub(super) fn is_free(&self, voxel: PatchVoxel) -> bool {
        self.free.binary_search(&voxel.place_in_block()).is_ok()
    }

    /// Number of voxels in free space.
    pub(super) fn free_voxels(&self) -> usize {
        self.free.len()
    }

    /// Forgets voxels that the block no longer has; returns whether it has any.
    pub(super) fn keep(&mut self, voxels: impl Iterator<Item = PatchVoxel>) -> bool {
        let left: Vec<u16> = voxels.map(PatchVoxel::place_in_block).collect();
        self.free.retain(|place| left.binary_search(place).is_ok());
        !left.is_empty()
    }

    /// Bytes that it owns.
    pub(super) fn memory_bytes(&self) -> usize {
        self.free.capacity() * size_of::<u16>()
    }

    /// Whether its numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(super) fn is_possible(&self) -> bool {
        self.unknown < 1 << 40
            && self.free.is_sorted_by(|a, b| a < b)
            && self.free.last().is_none_or(|&place| place < 1 << 12)
    }
}
