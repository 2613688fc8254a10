use std::ops::{Deref, Range};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use dymlm_core::Pages;

use super::{Extent, PageFile, Record};

/// What can be kept in a page file.
pub(crate) trait Block: Record + Default + Clone {}
impl<B: Record + Default + Clone> Block for B {}

/// A block that clones share until one of them changes it, in memory or in a page file. Reading a block that
/// is in the file brings it back to memory.
#[derive(Debug)]
pub(crate) struct Paged<B> {
    /// Blocks with one version are the same. Its lowest bit, [`KNOWN`], is no part of it.
    version: AtomicU64,
    memory: OnceLock<Arc<B>>,
    /// Where it is in the file; a block that is neither there nor in memory is empty.
    filed: Option<Filed>,
}

/// The part of an extent that holds a block.
#[derive(Debug, Clone)]
struct Filed {
    extent: Arc<Extent>,
    from: u32,
    length: u32,
}

/// Whether a clone or a [`Version`] may know the version: then a change of the block makes another one. A block
/// of which nobody knows is changed where it is, in the same version.
const KNOWN: u64 = 1;

/// A version in which a block was.
#[cfg(feature = "state")]
#[derive(Debug)]
pub(crate) struct Version(u64);

/// What can be paged out, whatever its type: several blocks at a time, so that they take one place in the
/// file.
pub(crate) trait PageOut {
    /// Appends the block to `out`, if it is in memory alone; returns its part of `out`.
    fn write(&self, out: &mut Vec<u8>) -> Option<Range<u32>>;

    /// Frees the memory of the block; `written`: its part of the extent, if it was written. Clones keep
    /// theirs.
    fn leave_memory(&mut self, extent: &Arc<Extent>, written: Option<Range<u32>>);
}

/// A block that is read without being moved.
pub(crate) enum Look<'a, B> {
    Memory(&'a B),
    File(B),
}

impl<B: Block> Paged<B> {
    pub(crate) fn new(block: B) -> Self {
        Self { memory: OnceLock::from(Arc::new(block)), ..Self::default() }
    }

    /// The block, to change it; it is copied while a clone shares it. Never `None`.
    #[inline]
    pub(crate) fn to_mut(&mut self) -> Option<&mut B> {
        let is_known = *self.version.get_mut() & KNOWN != 0;
        if is_known || self.filed.is_some() || self.memory.get_mut().is_none() {
            self.become_own();
        }
        self.memory.get_mut().map(Arc::make_mut)
    }

    /// Becomes a block that no clone shares, in a version that nobody knows.
    #[cold]
    fn become_own(&mut self) {
        let block = self.memory.take().unwrap_or_else(|| Arc::new(self.load()));
        *self = Self::new(Arc::unwrap_or_clone(block));
    }

    fn load(&self) -> B {
        let read = |filed: &Filed| filed.extent.read(filed.from, filed.length);
        self.filed.as_ref().map_or_else(B::default, read)
    }

    /// Whether a clone has the same block.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        self.number() == other.number()
    }

    /// The version of the block, without what is in it.
    #[cfg(feature = "state")]
    pub(crate) fn version(&self) -> Version {
        Version(self.make_known())
    }

    /// Whether the block is in this version.
    #[cfg(feature = "state")]
    pub(crate) fn is_in(&self, version: &Version) -> bool {
        self.number() == version.0
    }

    /// The block if it is in memory.
    pub(crate) fn in_memory(&self) -> Option<&B> {
        self.memory.get().map(Arc::as_ref)
    }

    /// The block, without bringing it back to memory.
    pub(crate) fn look(&self) -> Look<'_, B> {
        self.in_memory().map_or_else(|| Look::File(self.load()), Look::Memory)
    }

    /// Frees the memory of the block when another has the same block only in the file.
    pub(crate) fn page_out_like(&mut self, other: &Self) {
        if self.is_same(other) && other.filed.is_some() && other.in_memory().is_none() {
            *self = other.clone();
        }
    }

    /// Bytes of memory besides this struct that another block does not share, with those that the block owns,
    /// which `owned` gives for it beside the other.
    pub(crate) fn memory_bytes_beside(
        &self,
        other: Option<&Self>,
        owned: impl Fn(&B, Option<&B>) -> usize,
    ) -> usize {
        let (counts, other) = (2 * size_of::<usize>(), other.and_then(Self::in_memory));
        let own = self.in_memory().filter(|block| other.is_none_or(|other| !std::ptr::eq(*block, other)));
        own.map_or(0, |block| counts + size_of::<B>() + owned(block, other))
    }
}

impl<B: Block> PageOut for Paged<B> {
    fn write(&self, out: &mut Vec<u8>) -> Option<Range<u32>> {
        let block = self.in_memory().filter(|_| self.filed.is_none())?;
        let from = out.len() as u32;
        block.write(out);
        Some(from..out.len() as u32)
    }

    fn leave_memory(&mut self, extent: &Arc<Extent>, written: Option<Range<u32>>) {
        if let Some(Range { start, end }) = written {
            self.filed = Some(Filed { extent: Arc::clone(extent), from: start, length: end - start });
        }
        self.memory = OnceLock::new();
    }
}

/// Puts some blocks of a list into one place of a file.
pub(crate) fn page_out<B: Block>(
    blocks: &mut Pages<Paged<B>>,
    slots: &[usize],
    file: &Arc<PageFile>,
) -> std::io::Result<()> {
    if slots.is_empty() {
        return Ok(());
    }
    let mut bytes = Vec::new();
    let written: Vec<_> = slots.iter().map(|&slot| blocks[slot].write(&mut bytes)).collect();
    let extent = Arc::new(file.write(&mut bytes)?);
    for (&slot, written) in slots.iter().zip(written) {
        if let Some(block) = blocks.get_mut(slot) {
            block.leave_memory(&extent, written);
        }
    }
    Ok(())
}

impl<B> Paged<B> {
    /// The number of the version.
    fn number(&self) -> u64 {
        self.version.load(Ordering::Relaxed) & !KNOWN
    }

    /// The number of the version, which somebody knows from now on.
    fn make_known(&self) -> u64 {
        self.version.fetch_or(KNOWN, Ordering::Relaxed) & !KNOWN
    }
}

fn next_version() -> AtomicU64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    // Versions are only compared, so that results do not depend on their numbers.
    NEXT.fetch_add(KNOWN + 1, Ordering::Relaxed).into()
}

/// An empty block, which takes no memory.
impl<B> Default for Paged<B> {
    fn default() -> Self {
        Self { version: next_version(), memory: OnceLock::new(), filed: None }
    }
}

impl<B> Clone for Paged<B> {
    fn clone(&self) -> Self {
        let version = AtomicU64::new(self.make_known() | KNOWN);
        Self { version, memory: self.memory.clone(), filed: self.filed.clone() }
    }
}

impl<B: Block> Deref for Paged<B> {
    type Target = B;

    #[inline]
    fn deref(&self) -> &B {
        self.memory.get_or_init(|| Arc::new(self.load()))
    }
}

impl<B> Deref for Look<'_, B> {
    type Target = B;

    fn deref(&self) -> &B {
        match self {
            Look::Memory(block) => block,
            Look::File(block) => block,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn paged_out(block: &Paged<Vec<u32>>, file: &Arc<PageFile>) -> Paged<Vec<u32>> {
        let (mut block, mut bytes) = (block.clone(), vec![1, 2, 3]);
        let written = block.write(&mut bytes);
        block.leave_memory(&Arc::new(file.write(&mut bytes).unwrap()), written);
        block
    }

    #[test]
    fn a_block_in_the_file_is_what_it_was_in_memory() {
        let file = PageFile::create_in(&std::env::temp_dir()).unwrap();
        let original = Paged::new(vec![7, 8, 9]);
        let mut block = paged_out(&original, &file);
        assert!(block.is_same(&original) && block.in_memory().is_none());
        assert_eq!(*block.look(), [7, 8, 9]);
        assert!(block.in_memory().is_none(), "a look leaves it there");
        assert_eq!(*block, [7, 8, 9]);
        let again = paged_out(&block, &file);
        assert!(block.in_memory().is_some() && again.in_memory().is_none());

        block.to_mut().unwrap().push(10);
        assert!(!block.is_same(&original));
        assert_eq!((&*block, &*original, &*again), (&vec![7, 8, 9, 10], &vec![7, 8, 9], &vec![7, 8, 9]));
        assert!(file.failure().is_none());
    }

    #[test]
    fn a_clone_gives_its_memory_free_only_for_the_same_block() {
        let file = PageFile::create_in(&std::env::temp_dir()).unwrap();
        let original = Paged::new(vec![1]);
        let mut changed = original.clone();
        changed.to_mut().unwrap().push(2);
        let filed = paged_out(&changed, &file);
        let mut old = original.clone();
        old.page_out_like(&filed);
        assert!(old.in_memory().is_some());
        changed.page_out_like(&filed);
        assert!(changed.in_memory().is_none());
        assert_eq!((&*old, &*changed), (&vec![1], &vec![1, 2]));
    }

    #[test]
    fn what_changes_after_a_clone_has_gone_to_the_file_is_another_block() {
        let file = PageFile::create_in(&std::env::temp_dir()).unwrap();
        let mut own = Paged::new(vec![1]);
        let filed = paged_out(&own, &file);
        #[cfg(feature = "state")]
        let version = filed.version();
        own.to_mut().unwrap().push(2);
        assert!(!own.is_same(&filed));
        own.page_out_like(&filed);
        assert_eq!((&*own, &*filed), (&vec![1, 2], &vec![1]));
        #[cfg(feature = "state")]
        assert!(filed.is_in(&version) && !own.is_in(&version));
    }

    #[cfg(feature = "state")]
    #[test]
    fn a_change_makes_another_version_without_a_copy() {
        let file = PageFile::create_in(&std::env::temp_dir()).unwrap();
        let mut own = Paged::new(vec![1]);
        let items = own.as_ptr();
        for mut block in [own.clone(), paged_out(&own, &file), Paged::default()] {
            let version = block.version();
            assert!(block.is_in(&version));
            block.to_mut().unwrap().push(2);
            assert!(!block.is_in(&version));
        }
        let version = own.version();
        own.to_mut().unwrap()[0] = 3;
        assert!(!own.is_in(&version) && own.as_ptr() == items, "what it owns has only moved");
    }

    #[test]
    fn an_empty_block_is_changed_like_any_other() {
        let mut block = Paged::<Vec<u32>>::default();
        let clone = block.clone();
        assert!(block.is_empty());
        block.to_mut().unwrap().push(1);
        assert_eq!((&*block, &*clone), (&vec![1], &vec![]));
    }
}
