use dymlm_core::Rgb;

use crate::block_store::BLOCK_CELLS;
use crate::voxel::Voxel;

/// The voxels of 8^3 places that are not empty.
#[derive(Debug, Clone)]
pub(crate) struct VoxelBlock {
    /// For each place 1 + its index in `voxels`, or 0.
    index: [u16; BLOCK_CELLS],
    pub(crate) voxels: Vec<Voxel>,
    /// Weight of each voxel's readings without colour; shorter than `voxels`, mostly empty, where none has
    /// any.
    uncolored: Vec<u64>,
    /// Stamp of the last frame that touched the block.
    pub(crate) stamp: u32,
}

impl VoxelBlock {
    /// Index of the voxel at a place, made when there is none.
    #[inline]
    pub(crate) fn index_or_insert(&mut self, place: usize) -> u16 {
        if self.index[place] == 0 {
            if self.voxels.len() == self.voxels.capacity() {
                // Small steps: a surface fills an eighth of its block, doubling would waste a quarter of the
                // map.
                self.voxels.reserve_exact(16);
            }
            self.voxels.push(Voxel::default());
            self.index[place] = self.voxels.len() as u16;
        }
        self.index[place] - 1
    }

    /// The voxel at a place.
    #[inline]
    pub(crate) fn get(&self, place: usize) -> Option<&Voxel> {
        usize::from(self.index[place]).checked_sub(1).and_then(|index| self.voxels.get(index))
    }

    /// Adds to the weight of a voxel's readings without colour.
    pub(crate) fn add_uncolored(&mut self, index: u16, weight: u64) {
        let index = usize::from(index);
        if self.uncolored.len() <= index {
            self.uncolored.resize(self.voxels.len(), 0);
        }
        self.uncolored[index] = self.uncolored[index].wrapping_add(weight);
    }

    /// Weight of the readings without colour of the voxel with this index.
    pub(crate) fn uncolored(&self, index: u16) -> u64 {
        self.uncolored.get(usize::from(index)).copied().unwrap_or(0)
    }

    /// Adds a voxel's readings, of which those with the weight `uncolored` have no colour, to the voxel at a
    /// place.
    pub(crate) fn merge(&mut self, place: usize, voxel: &Voxel, uncolored: u64) {
        let index = self.index_or_insert(place);
        self.voxels[usize::from(index)].merge(voxel);
        if uncolored > 0 {
            self.add_uncolored(index, uncolored);
        }
    }

    /// Takes the readings out of the voxel at a place; gives them and the weight of those without colour.
    pub(crate) fn take(&mut self, place: usize) -> (Voxel, u64) {
        let index = usize::from(self.index_or_insert(place));
        let uncolored = self.uncolored.get_mut(index).map(std::mem::take);
        (std::mem::take(&mut self.voxels[index]), uncolored.unwrap_or(0))
    }

    /// Mean colour of the voxel with this index; `None` when all its readings came without.
    pub(crate) fn mean_color(&self, index: u16) -> Option<Rgb> {
        self.voxels.get(usize::from(index)).and_then(|voxel| voxel.mean_color(self.uncolored(index)))
    }

    /// Whether more was taken out than put in by the frame with this stamp.
    pub(crate) fn is_overdrawn(&self, stamp: u32) -> bool {
        let uncolored = self.uncolored.iter().copied().chain(std::iter::repeat(0));
        let of_frame = self.voxels.iter().zip(uncolored).filter(|(voxel, _)| voxel.stamp == stamp);
        of_frame.into_iter().any(|(voxel, uncolored)| voxel.is_overdrawn() || uncolored > voxel.weight())
    }

    /// Bytes that the block owns.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.voxels.capacity() * size_of::<Voxel>() + self.uncolored.capacity() * size_of::<u64>()
    }

    /// The index of the voxel at a place.
    pub(crate) fn index(&self, place: usize) -> Option<u16> {
        self.index[place].checked_sub(1)
    }

    /// The voxels by place.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, &Voxel)> {
        (0..BLOCK_CELLS).filter_map(|place| self.get(place).map(|voxel| (place, voxel)))
    }

    /// Drops the empty voxels; gives how many there were.
    pub(crate) fn drop_empty(&mut self) -> usize {
        let before = self.voxels.len();
        if self.voxels.iter().any(Voxel::is_empty) {
            let mut kept = Self { voxels: Vec::with_capacity(before), stamp: self.stamp, ..Self::default() };
            for (place, voxel) in self.iter().filter(|(_, voxel)| !voxel.is_empty()) {
                let uncolored = self.index(place).map_or(0, |index| self.uncolored(index));
                kept.merge(place, voxel, uncolored);
            }
            *self = kept;
        }
        before - self.voxels.len()
    }
}

impl Default for VoxelBlock {
    fn default() -> Self {
        Self { index: [0; BLOCK_CELLS], voxels: Vec::new(), uncolored: Vec::new(), stamp: 0 }
    }
}
