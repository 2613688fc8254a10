use dymlm_core::Rgb;
use serde::{Deserialize, Serialize};

use super::blocks_of;
use super::counts::SavedCells;
use crate::CloudMap;
use crate::block_store::{BlockKey, BlockStore, CUBE_BLOCKS};
use crate::voxel::{SUBVOXELS, Sums, Voxel};
use crate::voxel_block::VoxelBlock;

/// The voxels of a cube of blocks, number by number: numbers of a kind are alike.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedVoxels {
    /// A bit for each block of the cube that is there.
    blocks: u64,
    /// Which voxels each of them has.
    voxels: Vec<SavedCells>,
    weights: Vec<u64>,
    observations: Vec<u32>,
    /// Beside the middle of the voxel.
    positions: [Vec<i64>; 3],
    /// Beside the mean colour of the voxel before.
    colors: [Vec<i64>; 3],
    /// None where each reading has a colour.
    uncolored: Vec<u64>,
}

/// Of what a voxel's sums are expected to be.
struct Expected {
    color: Rgb,
}

impl Expected {
    fn position(weight: u64) -> u64 {
        weight.wrapping_mul(u64::from(SUBVOXELS.unsigned_abs() / 2))
    }

    fn color(&self, sums: &Sums, channel: usize) -> u64 {
        sums.weight.wrapping_sub(sums.uncolored).wrapping_mul(self.color[channel].into())
    }

    fn learn(&mut self, voxel: &Voxel) {
        self.color = voxel.mean_color().unwrap_or(self.color);
    }
}

impl SavedVoxels {
    /// `None` of a cube without blocks.
    pub(super) fn of(cube: BlockKey, store: &BlockStore<VoxelBlock>) -> Option<Self> {
        let blocks: Vec<(usize, &VoxelBlock)> =
            blocks_of(cube, store).map(|(place, slot)| (place, store.blocks()[slot].as_ref())).collect();
        let mut saved = Self {
            blocks: blocks.iter().fold(0, |bits, (place, _)| bits | 1 << place),
            voxels: blocks.iter().map(|(_, block)| SavedCells::of(block.places().cells())).collect(),
            weights: Vec::new(),
            observations: Vec::new(),
            positions: Default::default(),
            colors: Default::default(),
            uncolored: Vec::new(),
        };
        let mut expected = Expected { color: [128; 3] };
        for (_, voxel) in blocks.iter().flat_map(|(_, block)| block.iter()) {
            let sums = &voxel.sums;
            saved.weights.push(sums.weight);
            saved.observations.push(voxel.observations);
            for (axis, beside) in saved.positions.iter_mut().enumerate() {
                beside.push(sums.position[axis].wrapping_sub(Expected::position(sums.weight)) as i64);
            }
            for (channel, beside) in saved.colors.iter_mut().enumerate() {
                beside.push(sums.color[channel].wrapping_sub(expected.color(sums, channel)) as i64);
            }
            saved.uncolored.push(sums.uncolored);
            expected.learn(&voxel);
        }
        if saved.uncolored.iter().all(|&weight| weight == 0) {
            saved.uncolored.clear();
        }
        (saved.blocks != 0).then_some(saved)
    }

    /// Puts the voxels into a map that has none in the cube; `None` where they are none that a map can hold.
    pub(super) fn put_into(self, cube: BlockKey, map: &mut CloudMap) -> Option<()> {
        let count: usize = self.voxels.iter().map(SavedCells::len).sum();
        let lengths = [&self.positions, &self.colors].into_iter().flatten().map(Vec::len);
        let is_whole = lengths.chain([self.weights.len(), self.observations.len()]).all(|len| len == count)
            && (self.uncolored.is_empty() || self.uncolored.len() == count)
            && self.blocks.count_ones() as usize == self.voxels.len()
            && self.blocks != 0;
        if !is_whole {
            return None;
        }
        let mut expected = Expected { color: [128; 3] };
        let mut next = 0;
        let places = (0..CUBE_BLOCKS).filter(|place| self.blocks >> place & 1 == 1);
        for (place, cells) in places.zip(&self.voxels) {
            let voxels = (next..next + cells.len()).map(|index| self.voxel(index, &mut expected));
            let block = VoxelBlock::restored(cells.cells(), voxels.collect::<Option<Vec<_>>>()?);
            next += cells.len();
            map.put_block(cube.of_cube(place), block);
        }
        Some(())
    }

    fn voxel(&self, index: usize, expected: &mut Expected) -> Option<Voxel> {
        let mut sums = Sums {
            weight: *self.weights.get(index)?,
            uncolored: self.uncolored.get(index).copied().unwrap_or(0),
            ..Sums::default()
        };
        for (axis, beside) in self.positions.iter().enumerate() {
            sums.position[axis] = Expected::position(sums.weight).wrapping_add(*beside.get(index)? as u64);
        }
        for (channel, beside) in self.colors.iter().enumerate() {
            sums.color[channel] = expected.color(&sums, channel).wrapping_add(*beside.get(index)? as u64);
        }
        let voxel = Voxel { sums, observations: *self.observations.get(index)? };
        expected.learn(&voxel);
        Some(voxel)
    }
}
