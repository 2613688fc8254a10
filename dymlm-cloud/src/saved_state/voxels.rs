use dymlm_core::{BitReader, BitWriter};
use serde::{Deserialize, Serialize};

use super::blocks_of;
use super::counts::SavedCells;
use super::sums::SavedSums;
use crate::CloudMap;
use crate::block_store::{BlockKey, BlockStore, CUBE_BLOCKS};
use crate::voxel::{Sums, Voxel};
use crate::voxel_block::VoxelBlock;

/// The voxels of a cube of blocks, field by field: numbers of one kind are alike.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedVoxels {
    /// A bit for each block of the cube that is there.
    blocks: u64,
    /// The voxels of each of these blocks.
    voxels: Vec<SavedCells>,
    weights: Vec<u64>,
    observations: Vec<u32>,
    positions: [SavedSums; 3],
    colors: [SavedSums; 3],
    /// Empty where each reading has a colour.
    uncolored: Vec<u64>,
}

impl SavedVoxels {
    /// The voxels, and the rests of their sums; `None` for a cube without blocks.
    pub(super) fn of(cube: BlockKey, store: &BlockStore<VoxelBlock>) -> Option<(Self, Vec<u8>)> {
        let blocks: Vec<_> =
            blocks_of(cube, store).map(|(place, slot)| (place, store.blocks()[slot].look())).collect();
        if blocks.is_empty() {
            return None;
        }
        let voxels: Vec<Voxel> =
            blocks.iter().flat_map(|(_, block)| block.iter()).map(|(_, voxel)| voxel).collect();
        let sums = || voxels.iter().map(|voxel| &voxel.sums);
        let has_uncolored = sums().any(|sums| sums.uncolored != 0);
        let (mut rests, mut bytes) = (BitWriter::default(), Vec::new());
        let saved = Self {
            blocks: blocks.iter().fold(0, |bits, (place, _)| bits | 1 << place),
            voxels: blocks.iter().map(|(_, block)| SavedCells::of(block.places().cells())).collect(),
            weights: sums().map(|sums| sums.weight).collect(),
            observations: voxels.iter().map(|voxel| voxel.observations).collect(),
            positions: [0, 1, 2]
                .map(|axis| SavedSums::of(sums().map(|sums| (sums.position[axis], sums.weight)), &mut rests)),
            colors: [0, 1, 2].map(|channel| {
                SavedSums::of(sums().map(|sums| (sums.color[channel], colored(sums))), &mut rests)
            }),
            uncolored: if has_uncolored { sums().map(|sums| sums.uncolored).collect() } else { Vec::new() },
        };
        rests.finish(&mut bytes);
        Some((saved, bytes))
    }

    /// Puts the voxels into a map that has none in the cube; `None` for voxels that no map can hold.
    pub(super) fn put_into(self, cube: BlockKey, rests: &[u8], map: &mut CloudMap) -> Option<()> {
        let voxels = self.restored(rests)?;
        let count: usize = self.voxels.iter().map(SavedCells::len).sum();
        if self.blocks == 0 || self.blocks.count_ones() as usize != self.voxels.len() || count != voxels.len()
        {
            return None;
        }
        let mut voxels = voxels.into_iter();
        let places = (0..CUBE_BLOCKS).filter(|place| self.blocks >> place & 1 == 1);
        for (place, cells) in places.zip(&self.voxels) {
            let own = voxels.by_ref().take(cells.len()).collect();
            map.put_block(cube.of_cube(place), VoxelBlock::restored(cells.cells(), own));
        }
        Some(())
    }

    /// The voxels of all blocks, one after the other; `None` where some of their numbers are missing.
    fn restored(&self, mut rests: &[u8]) -> Option<Vec<Voxel>> {
        let count = self.weights.len();
        if self.observations.len() != count || ![0, count].contains(&self.uncolored.len()) {
            return None;
        }
        let uncolored = self.uncolored.iter().copied().chain(std::iter::repeat(0));
        let weights = self.weights.iter().copied().zip(uncolored);
        let mut voxels: Vec<Voxel> = weights
            .zip(&self.observations)
            .map(|((weight, uncolored), &observations)| Voxel {
                sums: Sums { weight, uncolored, ..Sums::default() },
                observations,
            })
            .collect();
        let mut rests = BitReader::take(&mut rests)?;
        for (axis, saved) in self.positions.iter().enumerate() {
            let sums = saved.restored(voxels.iter().map(|voxel| voxel.sums.weight), &mut rests)?;
            for (voxel, sum) in voxels.iter_mut().zip(sums) {
                voxel.sums.position[axis] = sum;
            }
        }
        for (channel, saved) in self.colors.iter().enumerate() {
            let sums = saved.restored(voxels.iter().map(|voxel| colored(&voxel.sums)), &mut rests)?;
            for (voxel, sum) in voxels.iter_mut().zip(sums) {
                voxel.sums.color[channel] = sum;
            }
        }
        Some(voxels)
    }
}

/// Weight of the readings that had a colour.
fn colored(sums: &Sums) -> u64 {
    sums.weight.wrapping_sub(sums.uncolored)
}
