use crate::block_store::BLOCK_CELLS;
use crate::voxel::Voxel;

/// The voxels of 8^3 places that are not empty.
#[derive(Debug, Clone)]
pub(crate) struct VoxelBlock {
    /// For each place 1 + its index in `voxels`, or 0.
    index: [u16; BLOCK_CELLS],
    pub(crate) voxels: Vec<Voxel>,
    /// Stamp of the last frame that touched the block.
    pub(crate) stamp: u32,
}

impl VoxelBlock {
    /// Index of the voxel at a place, made when there is none.
    #[inline]
    pub(crate) fn index_or_insert(&mut self, place: usize) -> u16 {
        if self.index[place] == 0 {
            if self.voxels.len() == self.voxels.capacity() {
                // Small steps: a surface fills an eighth of its block, doubling would waste a quarter of the map.
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

    /// The voxels by place.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (usize, &Voxel)> {
        (0..BLOCK_CELLS).filter_map(|place| self.get(place).map(|voxel| (place, voxel)))
    }

    /// Drops the empty voxels; gives how many there were.
    pub(crate) fn drop_empty(&mut self) -> usize {
        let before = self.voxels.len();
        if self.voxels.iter().any(Voxel::is_empty) {
            let mut kept = Vec::with_capacity(before);
            for index in &mut self.index {
                let voxel = usize::from(*index).checked_sub(1).and_then(|index| self.voxels.get(index));
                *index = match voxel.filter(|voxel| !voxel.is_empty()) {
                    Some(voxel) => {
                        kept.push(*voxel);
                        kept.len() as u16
                    }
                    None => 0,
                };
            }
            self.voxels = kept;
        }
        before - self.voxels.len()
    }
}

impl Default for VoxelBlock {
    fn default() -> Self {
        Self { index: [0; BLOCK_CELLS], voxels: Vec::new(), stamp: 0 }
    }
}
