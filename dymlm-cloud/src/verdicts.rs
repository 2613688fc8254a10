use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::block_store::BLOCK_SIDE;
use crate::verdict::VerdictGrid;
use crate::{CloudMap, Verdict};

/// What the evidence says of places, as of the newest frame ([`CloudMap::verdicts`]). All maps ask it, so
/// that none holds what another has found to be a ghost.
pub struct Verdicts<'a> {
    map: &'a CloudMap,
    grid: MutexGuard<'a, VerdictGrid>,
}

impl Verdicts<'_> {
    /// The verdict on a place, metres, world: [`Verdict::Static`] or [`Verdict::Ghost`]; `None` when nothing
    /// was ever read there.
    pub fn at(&self, place: [f64; 3]) -> Option<Verdict> {
        self.grid.of_voxel(&self.map.evidence, self.map.voxel_at(place)?)
    }

    /// Whether a place in which something was read is free now: frames look through it. A mover that stays is
    /// a ghost, but not free. `None` when nothing was ever read there.
    pub fn is_free(&self, place: [f64; 3]) -> Option<bool> {
        self.grid.is_free(&self.map.evidence, self.map.voxel_at(place)?)
    }

    /// Side of the cells for which verdicts are made, metres.
    pub fn cell_size(&self) -> f64 {
        self.map.evidence.cell_size()
    }

    /// Boxes (lowest and highest corner, metres, world) that hold a ghost, of those whose evidence has
    /// changed after a [revision](CloudMap::evidence_revision).
    pub fn ghost_boxes_since(&self, revision: u32) -> impl Iterator<Item = [[f64; 3]; 2]> {
        let side = self.cell_size() * BLOCK_SIDE as f64;
        self.grid.ghost_blocks_since(revision).filter_map(move |slot| {
            let block = self.map.evidence.blocks().keys().get(slot)?.block();
            Some([block.map(|c| f64::from(c) * side), block.map(|c| (f64::from(c) + 1.0) * side)])
        })
    }

    pub(crate) fn is_ghost(&self, voxel: [i32; 3]) -> bool {
        self.grid.is_ghost(&self.map.evidence, voxel)
    }
}

impl CloudMap {
    /// The verdicts of the evidence as it stands. Costs what has changed since the last call: some
    /// microseconds for each block of 8^3 cells.
    pub fn verdicts(&self) -> Verdicts<'_> {
        let mut grid = self.verdicts.lock();
        grid.refresh(&self.evidence, self.config.looks_per_reading as f32);
        Verdicts { map: self, grid }
    }

    /// A number that grows with each change of the evidence.
    pub fn evidence_revision(&self) -> u32 {
        self.evidence.revision()
    }
}

/// Verdicts behind a lock, so that reading a shared map brings them up to date.
#[derive(Debug, Default)]
pub(crate) struct SharedVerdicts(Mutex<VerdictGrid>);

impl SharedVerdicts {
    fn lock(&self) -> MutexGuard<'_, VerdictGrid> {
        // Blocks that a panic has left behind are still those of their revisions.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Clone for SharedVerdicts {
    fn clone(&self) -> Self {
        Self(Mutex::new(self.lock().clone()))
    }
}
