use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use crate::block_store::{BlockStore, CellBits, NEIGHBORS, step_to};
use crate::places::Places;
use crate::slot_index::KeyHasher;
use crate::static_cloud::Moments;
use crate::voxel_block::VoxelBlock;

/// What has changed in a block of voxels.
pub(crate) struct Change {
    pub(crate) slot: usize,
    /// 1 + the slot of its block of the evidence, or 0 as long as there is none.
    pub(crate) evidence: u32,
    /// The voxels that are no ghosts, and their weights by rank.
    pub(crate) firm: Places,
    pub(crate) weights: Vec<f32>,
    /// Whether one of these voxels looks for heavier ones around.
    pub(crate) looks_around: bool,
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
    /// How these changes can affect its voxels.
    pub(crate) effect: Effect,
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
        looks_around: impl Fn(usize) -> bool,
    ) -> Vec<Touched> {
        let mut touched: Vec<Touched> =
            self.changes.iter().map(|change| Touched::untouched(change.slot)).collect();
        let mut indices = self.indices.clone();
        for (own, change) in self.changes.iter().enumerate() {
            touched[own].around = voxels.neighborhood(change.slot);
            for (place, slot) in touched[own].around.into_iter().enumerate() {
                let Some(slot) = (slot as usize).checked_sub(1) else { continue };
                if !change.effect.is_any() || !looks_around(slot) {
                    continue;
                }
                let neighbor = Touched::at(slot, &mut touched, &mut indices);
                neighbor.effect = neighbor.effect.join(change.effect);
                neighbor.around[NEIGHBORS - 1 - place] = change.slot as u32 + 1;
            }
        }
        let resurfaced = |refit: &&Refit| refit.resurfaced != CellBits::default() && looks_around(refit.slot);
        for refit in refits.iter().filter(resurfaced) {
            Touched::at(refit.slot, &mut touched, &mut indices).resurfaced = refit.resurfaced;
        }
        touched
    }
}

impl Touched {
    fn untouched(slot: usize) -> Self {
        Self { slot, effect: Effect::default(), resurfaced: CellBits::default(), around: [0; NEIGHBORS] }
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
