use std::cell::Cell;
use std::ops::{Deref, DerefMut};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, TryLockError};

use crate::block_store::Retained;
use crate::paging::PageOut;
use crate::parallel;
use crate::static_cloud::StaticCloud;
use crate::verdict::VerdictGrid;

/// Results that follow from the sums, cached from call to call.
#[derive(Debug, Clone, Default)]
pub(crate) struct Kept {
    pub(crate) verdicts: VerdictGrid,
    pub(crate) cloud: Arc<StaticCloud>,
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
    /// How many waits this thread is in: whoever helps others while it waits may be given a task that waits as well.
    static WAITS: Cell<u32> = const { Cell::new(0) };
}

/// Waits within each other beyond which a thread does not wait for a cache: each is on its stack, with all that the
/// task above does, and pools of rayon's have stacks of 2 MB.
const MOST_WAITS: u32 = 16;

/// The cache of a map while it is brought up to date and read.
///
/// With the feature `parallel` the work is done on rayon's threads, while the cache is locked. A thread of the pool
/// that merely waited for the lock would not do that work, and if all of them did, nobody would; and a thread that
/// waits for its own part of the work may be given another task of the caller, which queries the same map. So
/// threads of the pool help others while they wait, and a thread that holds a cache already, or that waits too often
/// at once, waits for none: it works out what it asks for anew, for itself and alone, so that it is given no further
/// task.
pub(crate) struct Held<'a>(Holding<'a>);

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
        parallel::begin_alone();
        Self(Holding::Alone(Box::default()))
    }
}

impl Deref for Held<'_> {
    type Target = Kept;

    fn deref(&self) -> &Kept {
        match &self.0 {
            Holding::Locked(kept) => kept,
            Holding::Alone(kept) => kept,
        }
    }
}

impl DerefMut for Held<'_> {
    fn deref_mut(&mut self) -> &mut Kept {
        match &mut self.0 {
            Holding::Locked(kept) => kept,
            Holding::Alone(kept) => kept,
        }
    }
}

impl Drop for Held<'_> {
    fn drop(&mut self) {
        HOLDS.set(HOLDS.get().saturating_sub(1));
        if let Holding::Alone(_) = self.0 {
            parallel::end_alone();
        }
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
    /// Parts the cache from those of maps that its map is a clone of.
    pub(crate) fn part_from_clones(&mut self) {
        self.lineage = Lineage::default();
    }

    /// Whether the maps of two caches are clones of each other.
    pub(crate) fn is_clone_of(&self, other: &Self) -> bool {
        self.lineage == other.lineage
    }

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
        let other = other.hold();
        own.verdicts.page_out_like(&other.verdicts);
        if !Arc::ptr_eq(&own.cloud, &other.cloud) {
            Arc::make_mut(&mut own.cloud).page_out_like(&other.cloud);
        }
    }

    /// Takes over what a clone has cached, if it is newer; does nothing while the clone is being queried.
    pub(crate) fn adopt(&mut self, other: &Self) {
        if !self.is_clone_of(other) {
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
        let other = other.map_or_else(Kept::default, |other| Kept::clone(&other.hold()));
        let kept = self.hold();
        let is_shared = Arc::ptr_eq(&kept.cloud, &other.cloud);
        kept.verdicts.memory_bytes_beside(&other.verdicts)
            + if is_shared { 0 } else { kept.cloud.memory_bytes_beside(&other.cloud) }
    }

    /// Bytes without the blocks.
    pub(crate) fn list_bytes(&self) -> usize {
        let Kept { verdicts, cloud } = &*self.hold();
        verdicts.list_bytes_beside(&VerdictGrid::default()) + cloud.list_bytes_beside(&StaticCloud::default())
    }

    /// Bytes of memory of the verdicts on some blocks of the evidence, and of the static points of some
    /// blocks of voxels.
    pub(crate) fn block_bytes(
        &self,
        evidence: impl IntoIterator<Item = usize>,
        voxels: impl IntoIterator<Item = usize>,
    ) -> usize {
        let Kept { verdicts, cloud } = &*self.hold();
        let verdicts: usize = evidence.into_iter().map(|slot| verdicts.block_bytes(slot)).sum();
        verdicts + voxels.into_iter().map(|slot| cloud.block_bytes(slot)).sum::<usize>()
    }

    /// What is cached. Whoever brings it up to date may work on rayon's threads: see [`Held`].
    pub(crate) fn hold(&self) -> Held<'_> {
        loop {
            match self.kept.try_lock() {
                Ok(kept) => return Held::locked(kept),
                Err(TryLockError::Poisoned(poisoned)) => return Held::locked(self.renewed(poisoned)),
                Err(TryLockError::WouldBlock) if HOLDS.get() > 0 || WAITS.get() >= MOST_WAITS => {
                    return Held::alone();
                }
                Err(TryLockError::WouldBlock) => {
                    WAITS.set(WAITS.get() + 1);
                    let has_helped = parallel::helps_others();
                    WAITS.set(WAITS.get() - 1);
                    if !has_helped {
                        let kept = self.kept.lock();
                        return Held::locked(kept.unwrap_or_else(|poisoned| self.renewed(poisoned)));
                    }
                }
            }
        }
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
        Self { kept: Mutex::new(Kept::clone(&self.hold())), lineage: self.lineage }
    }
}
