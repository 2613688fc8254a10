use std::cell::Cell;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

use dymlm_core::vector3::bounds;

use crate::block_store::Retained;
use crate::paging::PageOut;
use crate::static_cloud::{Source, StaticCloud};
use crate::verdict::VerdictGrid;
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
        self.kept.get().verdicts.of_voxel(&self.map.evidence, self.map.voxel_at(place)?)
    }

    /// Whether a place in which something was read is free now: frames look through it. A mover that stays is
    /// a ghost, but not free. `None` when nothing was ever read there.
    pub fn is_free(&self, place: [f64; 3]) -> Option<bool> {
        self.kept.get().verdicts.is_free(&self.map.evidence, self.map.voxel_at(place)?)
    }

    /// Whether a place is empty: frames look through it, and nothing stands there, not even a mover. Where
    /// something was read this is the answer of [`is_free`](Self::is_free). `None` when no frame has seen the
    /// place.
    pub fn is_empty(&self, place: [f64; 3]) -> Option<bool> {
        let voxel = self.map.voxel_at(place)?;
        let read = self.kept.get().verdicts.is_free(&self.map.evidence, voxel);
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
        let slots = self.kept.get().verdicts.ghost_blocks_since(&self.map.evidence, revision);
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
        kept.get_mut().verdicts.refresh(&self.evidence, self.config.looks_per_reading as f32);
        Verdicts { map: self, kept }
    }

    /// A number that grows with each change of the evidence.
    pub fn evidence_revision(&self) -> u32 {
        self.evidence.revision()
    }

    /// The static cloud, with all changes taken in.
    pub(crate) fn kept_cloud(&self) -> Arc<StaticCloud> {
        let mut kept = self.verdicts().kept;
        let Kept { verdicts, cloud } = kept.get_mut();
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
        self.kept.lineage = Lineage::default();
    }

    /// Whether two maps are clones of each other, and so have their blocks at the same slots.
    pub(crate) fn is_clone_of(&self, other: &Self) -> bool {
        self.kept.lineage == other.kept.lineage
    }
}

/// Results that follow from the sums, cached from call to call.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kept {
    verdicts: VerdictGrid,
    cloud: Arc<StaticCloud>,
}

/// The cache behind a lock, so that querying a shared map brings it up to date.
#[derive(Debug, Default)]
pub(crate) struct SharedKept {
    kept: Mutex<Kept>,
    /// Maps with one lineage have their blocks at the same slots, and stamps that continue each other's.
    lineage: Lineage,
}

thread_local! {
    /// How many caches this thread holds.
    static HOLDS: Cell<u32> = const { Cell::new(0) };
}

/// The cache of a map while it is brought up to date and read.
///
/// With the feature `parallel` the work is done on rayon's threads, while the cache is locked. A thread of the pool
/// that merely waited for the lock would not do that work, and if all of them did, nobody would; and a thread that
/// waits for its own part of the work may be given another task of the caller, which queries the same map. So
/// threads of the pool help others while they wait, and a thread that holds a cache already waits for none: it
/// works out what it asks for anew, for itself.
struct Held<'a>(Holding<'a>);

enum Holding<'a> {
    Locked(MutexGuard<'a, Kept>),
    Alone(Box<Kept>),
}

impl<'a> Held<'a> {
    fn locked(kept: MutexGuard<'a, Kept>) -> Self {
        HOLDS.set(HOLDS.get() + 1);
        Self(Holding::Locked(kept))
    }

    fn alone() -> Self {
        HOLDS.set(HOLDS.get() + 1);
        Self(Holding::Alone(Box::default()))
    }

    fn get(&self) -> &Kept {
        match &self.0 {
            Holding::Locked(kept) => kept,
            Holding::Alone(kept) => kept,
        }
    }

    fn get_mut(&mut self) -> &mut Kept {
        match &mut self.0 {
            Holding::Locked(kept) => kept,
            Holding::Alone(kept) => kept,
        }
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        HOLDS.set(HOLDS.get().saturating_sub(1));
    }
}

/// Tells apart maps that are no clones of each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
struct Lineage(u64);

impl Default for Lineage {
    fn default() -> Self {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        // Lineages are only compared, so that results do not depend on their numbers.
        Self(NEXT.fetch_add(1, Ordering::Relaxed))
    }
}

impl SharedKept {
    /// Forgets everything that is cached.
    pub(crate) fn clear(&mut self) {
        *self = Self::default();
    }

    /// Forgets what is cached for blocks that are gone. `cells`: which blocks of the evidence stayed; `voxels`: by
    /// slot, which blocks of voxels stayed, if any went; `bounds`: the [bounds](BlockStore::bounds) of those now.
    pub(crate) fn forget(
        &mut self,
        cells: &Retained,
        voxels: Option<&[bool]>,
        bounds: Option<[[i32; 3]; 2]>,
    ) {
        self.lineage = Lineage::default();
        let Kept { verdicts, cloud } = self.kept.get_mut().unwrap_or_else(PoisonError::into_inner);
        verdicts.forget(cells);
        Arc::make_mut(cloud).forget(voxels, bounds);
    }

    /// The newest stamp of voxels that the static cloud has taken in.
    pub(crate) fn stamp(&mut self) -> u32 {
        self.kept.get_mut().unwrap_or_else(PoisonError::into_inner).cloud.stamp()
    }

    /// The last change of the evidence on which there are verdicts.
    pub(crate) fn judged(&mut self) -> u32 {
        self.kept.get_mut().unwrap_or_else(PoisonError::into_inner).verdicts.taken_in()
    }

    /// Calls `visit` with the verdicts on a block of the evidence, and with the static points of some blocks
    /// of voxels.
    pub(crate) fn for_each_within(
        &mut self,
        evidence: usize,
        voxels: &[usize],
        mut visit: impl FnMut(&mut dyn PageOut),
    ) {
        let Kept { verdicts, cloud } = self.kept.get_mut().unwrap_or_else(PoisonError::into_inner);
        if let Some(block) = verdicts.paged_mut(evidence) {
            visit(block);
        }
        let cloud = Arc::make_mut(cloud);
        for &slot in voxels {
            if let Some(block) = cloud.paged_mut(slot) {
                visit(block);
            }
        }
    }

    /// Frees the memory of blocks that a clone has paged out.
    pub(crate) fn page_out_like(&mut self, other: &Self) {
        let own = self.kept.get_mut().unwrap_or_else(PoisonError::into_inner);
        let other = other.lock();
        own.verdicts.page_out_like(&other.verdicts);
        if !Arc::ptr_eq(&own.cloud, &other.cloud) {
            Arc::make_mut(&mut own.cloud).page_out_like(&other.cloud);
        }
    }

    /// Takes over what a clone has cached, if it is newer; does nothing while the clone is being queried.
    pub(crate) fn adopt(&mut self, other: &Self) {
        if self.lineage != other.lineage {
            return;
        }
        let (Ok(own), Ok(other)) = (self.kept.get_mut(), other.kept.try_lock()) else { return };
        if other.cloud.stamp() > own.cloud.stamp() {
            *own = other.clone();
        }
    }

    /// Bytes that another cache does not share.
    pub(crate) fn memory_bytes_beside(&self, other: Option<&Self>) -> usize {
        // A clone, so that no two locks are held at a time.
        let other = other.map_or_else(Kept::default, |other| other.lock().clone());
        let kept = self.lock();
        let is_shared = Arc::ptr_eq(&kept.cloud, &other.cloud);
        kept.verdicts.memory_bytes_beside(&other.verdicts)
            + if is_shared { 0 } else { kept.cloud.memory_bytes_beside(&other.cloud) }
    }

    /// Bytes without the blocks.
    pub(crate) fn list_bytes(&self) -> usize {
        let Kept { verdicts, cloud } = &*self.lock();
        verdicts.list_bytes_beside(&VerdictGrid::default()) + cloud.list_bytes_beside(&StaticCloud::default())
    }

    /// Bytes of memory of the verdicts on some blocks of the evidence, and of the static points of some
    /// blocks of voxels.
    pub(crate) fn block_bytes(
        &self,
        evidence: impl IntoIterator<Item = usize>,
        voxels: impl IntoIterator<Item = usize>,
    ) -> usize {
        let Kept { verdicts, cloud } = &*self.lock();
        let verdicts: usize = evidence.into_iter().map(|slot| verdicts.block_bytes(slot)).sum();
        verdicts + voxels.into_iter().map(|slot| cloud.block_bytes(slot)).sum::<usize>()
    }

    /// What is cached, to bring it up to date, which may work on rayon's threads: see [`Held`].
    fn hold(&self) -> Held<'_> {
        loop {
            match self.kept.try_lock() {
                Ok(kept) => return Held::locked(kept),
                Err(TryLockError::Poisoned(poisoned)) => return Held::locked(self.renewed(poisoned)),
                Err(TryLockError::WouldBlock) if HOLDS.get() > 0 => return Held::alone(),
                Err(TryLockError::WouldBlock) => {
                    if !crate::parallel::helps_others() {
                        return Held::locked(self.lock());
                    }
                }
            }
        }
    }

    fn lock(&self) -> MutexGuard<'_, Kept> {
        self.kept.lock().unwrap_or_else(|poisoned| self.renewed(poisoned))
    }

    /// An empty cache: a panic may have left it half updated.
    fn renewed<'a>(&self, poisoned: PoisonError<MutexGuard<'a, Kept>>) -> MutexGuard<'a, Kept> {
        let mut kept = poisoned.into_inner();
        *kept = Kept::default();
        self.kept.clear_poison();
        kept
    }
}

impl Clone for SharedKept {
    fn clone(&self) -> Self {
        Self { kept: Mutex::new(self.lock().clone()), lineage: self.lineage }
    }
}
