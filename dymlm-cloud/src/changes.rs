use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use crate::block_store::{BLOCK_SIDE, BlockStore, CellBits, NEIGHBORS, step_to, union};
use crate::slot_index::KeyHasher;
use crate::static_cloud::Moments;
use crate::thinning::Weights;
use crate::voxel_block::VoxelBlock;

/// What has changed in a block of voxels.
pub(crate) struct Change {
    pub(crate) slot: usize,
    /// 1 + the slot of its block of the evidence, or 0 as long as there is none.
    pub(crate) evidence: u32,
    /// The voxels that are no ghosts, the weights of those that enough frames have read, and the greatest
    /// of these.
    pub(crate) firm: CellBits,
    pub(crate) weights: Box<Weights>,
    pub(crate) heaviest: f32,
    /// How far these voxels look for heavier ones around, whole voxels.
    pub(crate) reach: u8,
    /// Those of these voxels that have other readings or another verdict than before.
    pub(crate) voxels: CellBits,
    pub(crate) effect: Effect,
    /// Moments of the voxels that are no ghosts.
    pub(crate) moments: Moments,
}

/// How changes can affect the voxels around.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Effect {
    /// Greatest of the new weights.
    pub(crate) raised: f32,
    /// Upper bound of the weights that are gone.
    pub(crate) lowered: f32,
}

/// A block with changes in it, or within reach of its voxels.
pub(crate) struct Touched {
    pub(crate) slot: usize,
    /// How these changes can affect its voxels, and those that have any of them within reach.
    pub(crate) effect: Effect,
    pub(crate) near: CellBits,
    /// Voxels through which its surface passes now, or has passed before, but not both.
    pub(crate) resurfaced: CellBits,
    /// 1 + the slots of the blocks around, itself among them; 0 where there is none or it is not known. Known
    /// are the blocks that have changed, and all of them when the block itself has changed.
    around: [u32; NEIGHBORS],
}

/// A block whose surface is another than before.
pub(crate) struct Refit {
    pub(crate) slot: usize,
    /// Voxels through which the surface passes now, or has passed before, but not both.
    pub(crate) resurfaced: CellBits,
}

/// All changes, by blocks.
pub(crate) struct Changes {
    changes: Vec<Change>,
    /// By slot, the index of the block's change.
    indices: SlotMap,
}

/// A number for some slots.
type SlotMap = HashMap<u64, u32, BuildHasherDefault<KeyHasher>>;

impl Changes {
    pub(crate) fn new(changes: Vec<Change>) -> Self {
        let indices = changes.iter().zip(0..).map(|(change, index)| (change.slot as u64, index)).collect();
        Self { changes, indices }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &Change> {
        self.changes.iter()
    }

    /// The change of the block at a slot.
    pub(crate) fn of(&self, slot: usize) -> Option<&Change> {
        self.indices.get(&(slot as u64)).and_then(|&index| self.changes.get(index as usize))
    }

    /// The blocks that have changed, and of the blocks around them and those with another surface the ones with
    /// a voxel that looks beyond its own place.
    pub(crate) fn touched(
        &self,
        voxels: &BlockStore<VoxelBlock>,
        refits: &[Refit],
        reach: impl Fn(usize) -> u8,
    ) -> Vec<Touched> {
        let mut touched: Vec<Touched> =
            self.changes.iter().map(|change| Touched::untouched(change.slot)).collect();
        let mut indices = self.indices.clone();
        for (own, change) in self.changes.iter().enumerate() {
            touched[own].around = voxels.neighborhood(change.slot);
            if !change.effect.is_any() {
                continue;
            }
            let extent = change.extent();
            for (place, slot) in touched[own].around.into_iter().enumerate() {
                let Some(slot) = (slot as usize).checked_sub(1) else { continue };
                let Some(near) = extent.near(step_to(place), reach(slot)) else { continue };
                let neighbor = Touched::at(slot, &mut touched, &mut indices);
                neighbor.effect = neighbor.effect.join(change.effect);
                neighbor.near = union(neighbor.near, near);
                neighbor.around[NEIGHBORS - 1 - place] = change.slot as u32 + 1;
            }
        }
        let resurfaced = |refit: &&Refit| refit.resurfaced != CellBits::default() && reach(refit.slot) > 0;
        for refit in refits.iter().filter(resurfaced) {
            Touched::at(refit.slot, &mut touched, &mut indices).resurfaced = refit.resurfaced;
        }
        touched
    }
}

impl Change {
    /// The box around all that has changed in the block.
    fn extent(&self) -> Extent {
        // What was lowered may be anywhere.
        if self.effect.lowered == f32::INFINITY { Extent::WHOLE } else { Extent::of(&self.voxels) }
    }
}

/// A box in a block: the lowest and the highest coordinates of its cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Extent {
    low: [i32; 3],
    high: [i32; 3],
}

impl Extent {
    const WHOLE: Self = Self { low: [0; 3], high: [BLOCK_SIDE as i32 - 1; 3] };

    /// The box around some cells; of none, a box that is near nothing.
    fn of(cells: &CellBits) -> Self {
        let side = BLOCK_SIDE as i32;
        // A word is a layer, a byte of it is a row.
        let layer = cells.iter().fold(0, |layer, word| layer | word);
        let row = layer.to_le_bytes().into_iter().fold(0, |row, byte| row | byte);
        let layers = cells.iter().rev().fold(0_u8, |layers, word| layers << 1 | u8::from(*word != 0));
        let low = [
            row.trailing_zeros() as i32,
            layer.trailing_zeros() as i32 / side,
            layers.trailing_zeros() as i32,
        ];
        let high =
            [row.leading_zeros() as i32, layer.leading_zeros() as i32 / side, layers.leading_zeros() as i32];
        Self { low, high: high.map(|zeros| side - 1 - zeros) }
    }

    /// The cells of the block to which `step` leads that have a cell of the box within `reach` along each axis;
    /// `None` when there are none, or when they reach no other cell.
    fn near(&self, step: [i32; 3], reach: u8) -> Option<CellBits> {
        let (side, reach) = (BLOCK_SIDE as i32, i32::from(reach));
        let [xs, ys, zs] = [0, 1, 2].map(|axis| {
            let first = self.low[axis] - reach - side * step[axis];
            let last = self.high[axis] + reach - side * step[axis];
            first.max(0)..(last + 1).min(side)
        });
        let is_empty = self.low[0] > self.high[0];
        if is_empty || reach == 0 || xs.is_empty() || ys.is_empty() || zs.is_empty() {
            return None;
        }
        let row = 0xFF_u64 >> (side - xs.end) & 0xFF << xs.start;
        let rows = u64::MAX >> (side * (side - ys.end)) & u64::MAX << (side * ys.start);
        let layer = (row * 0x0101_0101_0101_0101) & rows;
        Some(std::array::from_fn(|z| if zs.contains(&(z as i32)) { layer } else { 0 }))
    }
}

impl Touched {
    fn untouched(slot: usize) -> Self {
        let none = CellBits::default();
        Self { slot, effect: Effect::default(), near: none, resurfaced: none, around: [0; NEIGHBORS] }
    }

    /// The block at a slot among those that are `touched`, added when it is not one of them; `indices`: where they
    /// are, by slot.
    fn at<'a>(slot: usize, touched: &'a mut Vec<Self>, indices: &mut SlotMap) -> &'a mut Self {
        let index = *indices.entry(slot as u64).or_insert_with(|| {
            touched.push(Self::untouched(slot));
            touched.len() as u32 - 1
        });
        &mut touched[index as usize]
    }

    /// The blocks around that are known: the steps to them, and their slots.
    pub(crate) fn around(&self) -> impl Iterator<Item = ([i32; 3], usize)> {
        let known = self.around.iter().enumerate().filter(|(_, slot)| **slot > 0);
        known.map(|(place, &slot)| (step_to(place), slot as usize - 1))
    }

    /// Finds all blocks around.
    pub(crate) fn find_around(&mut self, voxels: &BlockStore<VoxelBlock>) {
        self.around = voxels.neighborhood(self.slot);
    }
}

impl Effect {
    fn join(self, other: Self) -> Self {
        Self { raised: self.raised.max(other.raised), lowered: self.lowered.max(other.lowered) }
    }

    pub(crate) fn is_any(self) -> bool {
        self.raised > 0.0 || self.lowered > 0.0
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;

    use super::*;
    use crate::block_store::{BLOCK_CELLS, cell_in_block, has, put};

    #[test]
    fn the_cells_near_a_box_are_those_within_reach_of_one_of_its_cells() {
        let mut random = SplitMix64::new(5);
        let mut index = |count: usize| (count as f64 * random.fraction()) as usize;
        for turn in 0..300 {
            let mut cells = CellBits::default();
            let corners: Vec<[i32; 3]> = (0..turn % 4).map(|_| cell_in_block(index(BLOCK_CELLS))).collect();
            for [x, y, z] in corners.iter().map(|corner| corner.map(|c| c as usize)) {
                put(&mut cells, z << 6 | y << 3 | x);
            }
            let (step, reach) = (step_to(index(NEIGHBORS)), index(9) as u8);
            let near = Extent::of(&cells).near(step, reach).unwrap_or_default();
            for place in 0..BLOCK_CELLS {
                let cell = cell_in_block(place);
                let is_near = |axis: usize| {
                    let along = || corners.iter().map(|corner| corner[axis]);
                    let c = cell[axis] + 8 * step[axis];
                    let (low, high) = (along().min().unwrap_or(99), along().max().unwrap_or(-99));
                    (low - i32::from(reach)..=high + i32::from(reach)).contains(&c)
                };
                let expected = reach > 0 && !corners.is_empty() && (0..3).all(is_near);
                assert_eq!(has(&near, place), expected, "{cell:?}, {step:?}, {reach}, {corners:?}");
            }
        }
    }
}
