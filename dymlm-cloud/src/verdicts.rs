use std::sync::Arc;

use dymlm_core::vector3::bounds;

use crate::shared_kept::{Held, Kept};
use crate::static_cloud::{Source, StaticCloud};
use crate::{CloudMap, Verdict};

/// The evidence's verdicts on places, as of the newest frame ([`CloudMap::verdicts`]). All maps ask them, so
/// that no map holds what another has found to be a ghost.
///
/// Whoever holds them keeps other threads from querying the same map.
pub struct Verdicts<'a> {
    map: &'a CloudMap,
    kept: Held<'a>,
}

impl Verdicts<'_> {
    /// The verdict on a place, metres, world: [`Verdict::Static`] or [`Verdict::Ghost`]; `None` when nothing
    /// was ever read there.
    pub fn at(&self, place: [f64; 3]) -> Option<Verdict> {
        self.kept.verdicts.of_voxel(&self.map.evidence, self.map.voxel_at(place)?)
    }

    /// Whether a place in which something was read is free now: frames look through it. A mover that stays is
    /// a ghost, but not free. `None` when nothing was ever read there.
    pub fn is_free(&self, place: [f64; 3]) -> Option<bool> {
        self.kept.verdicts.is_free(&self.map.evidence, self.map.voxel_at(place)?)
    }

    /// Whether a place is empty: frames look through it, and nothing stands there, not even a mover. Where
    /// something was read this is the answer of [`is_free`](Self::is_free). `None` when no frame has seen the
    /// place.
    pub fn is_empty(&self, place: [f64; 3]) -> Option<bool> {
        let voxel = self.map.voxel_at(place)?;
        let read = self.kept.verdicts.is_free(&self.map.evidence, voxel);
        read.or_else(|| self.map.evidence.is_looked_through(voxel).then_some(true))
    }

    /// Side of the cells for which verdicts are made, metres.
    pub fn cell_size(&self) -> f64 {
        self.map.evidence.cell_size()
    }

    /// Boxes (lowest and highest corner, metres, world) that hold a ghost, among those in which verdicts may
    /// have changed after a [revision](CloudMap::evidence_revision): their evidence has, or that beside them.
    pub fn ghost_boxes_since(&self, revision: u32) -> impl Iterator<Item = [[f64; 3]; 2]> {
        let (keys, cell_size) = (self.map.evidence.blocks().keys(), self.cell_size());
        let slots = self.kept.verdicts.ghost_blocks_since(&self.map.evidence, revision);
        slots.into_iter().filter_map(move |slot| keys.get(slot).map(|key| key.bounds(cell_size)))
    }

    /// The box (lowest and highest corner, metres, world) around all places on which verdicts may have changed
    /// after a [revision](CloudMap::evidence_revision); `None` when there are none.
    pub fn changed_bounds_since(&self, revision: u32) -> Option<[[f64; 3]; 2]> {
        let (blocks, cell_size) = (self.map.evidence.blocks(), self.cell_size());
        let changed = blocks.stamps().after(revision).filter_map(|slot| blocks.keys().get(slot));
        let [low, high] = bounds(changed.flat_map(|key| key.bounds(cell_size)));
        // The cells beside a block vote on those of the block.
        let around = [low.map(|c| c - cell_size), high.map(|c| c + cell_size)];
        (low[0] <= high[0]).then_some(around)
    }
}

impl CloudMap {
    /// The verdicts of the evidence as it is now. Costs what has changed since the last call: some
    /// microseconds for each block of 8^3 cells.
    pub fn verdicts(&self) -> Verdicts<'_> {
        let mut kept = self.kept.hold();
        kept.verdicts.refresh(&self.evidence, self.config.looks_per_reading as f32);
        Verdicts { map: self, kept }
    }

    /// A number that grows with each change of the evidence.
    pub fn evidence_revision(&self) -> u32 {
        self.evidence.revision()
    }

    /// The static cloud, with all changes taken in.
    pub(crate) fn kept_cloud(&self) -> Arc<StaticCloud> {
        let mut kept = self.verdicts().kept;
        let Kept { verdicts, cloud } = &mut *kept;
        let source = Source {
            voxels: &self.voxels,
            stamp: self.stamp,
            evidence: &self.evidence,
            verdicts,
            thinning: &self.thinning,
            voxel_size: self.config.voxel_size,
            fuses: self.config.fuse_surfaces,
        };
        // Whoever holds the cloud borrows the map, so it cannot have changed meanwhile: the cloud is copied
        // only for a map that has a clone.
        if !cloud.is_fresh(&source) {
            Arc::make_mut(cloud).refresh(source, self.page_file.as_ref());
        }
        Arc::clone(cloud)
    }
}

impl CloudMap {
    /// Takes over the static cloud that a clone of an earlier state of this map has worked out, if it is
    /// newer than the one here; later changes are taken in by the next query. Does nothing while the clone is
    /// being queried.
    pub fn adopt_static(&mut self, earlier: &Self) {
        self.kept.adopt(&earlier.kept);
    }
}

impl CloudMap {
    /// Parts the map from the maps that it is a clone of: what those work out from now on does not hold here.
    /// Must be called when a clone of an earlier state takes the place of the map.
    pub fn part_from_clones(&mut self) {
        self.kept.part_from_clones();
    }

    /// Whether two maps are clones of each other, and so have the blocks at the same slots that they had in common.
    pub(crate) fn is_clone_of(&self, other: &Self) -> bool {
        self.kept.is_clone_of(&other.kept)
    }
}
