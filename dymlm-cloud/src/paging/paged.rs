use std::io::Result;
use std::ops::Deref;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, OnceLock};

use super::page_file::{Extent, PageFile};
use super::record::Record;

/// What can be kept in a page file.
pub(crate) trait Block: Record + Default + Clone {}
impl<B: Record + Default + Clone> Block for B {}

/// A block that clones share until one changes it, in memory or in a page file. Who reads one that is in the
/// file brings it back to memory.
#[derive(Debug)]
pub(crate) struct Paged<B> {
    /// Blocks of one version are the same.
    version: u64,
    memory: Option<Arc<B>>,
    /// Where it is when it is not in memory; nowhere: it is empty.
    filed: OnceLock<Arc<Filed<B>>>,
}

#[derive(Debug)]
struct Filed<B> {
    /// None for an empty block.
    extent: Option<Arc<Extent>>,
    /// The block, once somebody has read it.
    read: OnceLock<Arc<B>>,
}

/// A block that somebody looks at: it stays where it is.
pub(crate) enum Look<'a, B> {
    Memory(&'a B),
    File(B),
}

impl<B: Block> Paged<B> {
    pub(crate) fn new(block: B) -> Self {
        Self { version: next_version(), memory: Some(Arc::new(block)), filed: OnceLock::new() }
    }

    /// The block, to be changed; it is copied while a clone has it.
    #[inline]
    pub(crate) fn to_mut(&mut self) -> &mut B {
        if self.memory.as_mut().and_then(Arc::get_mut).is_none() {
            self.version = next_version();
        }
        let filed = &mut self.filed;
        let block = self.memory.get_or_insert_with(|| match filed.take() {
            Some(filed) => Arc::clone(filed.block()),
            None => Arc::default(),
        });
        Arc::make_mut(block)
    }

    /// Whether a clone has the same block.
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        self.version == other.version
    }

    /// The block if it is in memory.
    pub(crate) fn in_memory(&self) -> Option<&B> {
        let read = || self.filed.get().and_then(|filed| filed.read.get());
        self.memory.as_ref().or_else(read).map(Arc::as_ref)
    }

    /// The block, without bringing it back to memory.
    pub(crate) fn look(&self) -> Look<'_, B> {
        match self.in_memory() {
            Some(block) => Look::Memory(block),
            None => Look::File(self.filed.get().map_or_else(B::default, |filed| filed.load())),
        }
    }

    /// Gives the memory of the block free; clones keep theirs.
    pub(crate) fn page_out(&mut self, file: &Arc<PageFile>, buffer: &mut Vec<u8>) -> Result<()> {
        let extent = match (&self.memory, self.filed.get()) {
            (Some(block), _) => Some(Arc::new(file.write(block.as_ref(), buffer)?)),
            (None, Some(filed)) if filed.read.get().is_some() => filed.extent.clone(),
            (None, _) => return Ok(()),
        };
        self.memory = None;
        self.filed = OnceLock::from(Arc::new(Filed { extent, read: OnceLock::new() }));
        Ok(())
    }

    /// Gives the memory of the block free when another has the same in the file.
    pub(crate) fn page_out_like(&mut self, other: &Self) {
        if self.is_same(other) && other.memory.is_none() {
            *self = other.clone();
        }
    }

    /// Bytes of memory beside this, with those that the block owns, which `owned` tells.
    pub(crate) fn memory_bytes(&self, owned: impl Fn(&B) -> usize) -> usize {
        let counts = 2 * size_of::<usize>();
        let block = self.in_memory().map_or(0, |block| counts + size_of::<B>() + owned(block));
        let filed = self.filed.get().map_or(0, |_| 2 * counts + size_of::<Filed<B>>() + size_of::<Extent>());
        block + filed
    }
}

impl<B: Block> Filed<B> {
    fn block(&self) -> &Arc<B> {
        self.read.get_or_init(|| Arc::new(self.load()))
    }

    fn load(&self) -> B {
        self.extent.as_ref().map_or_else(B::default, |extent| extent.read())
    }
}

impl<B> Default for Filed<B> {
    fn default() -> Self {
        Self { extent: None, read: OnceLock::new() }
    }
}

fn next_version() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    // Only compared, so that results do not depend on it.
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// An empty block, which takes no memory.
impl<B> Default for Paged<B> {
    fn default() -> Self {
        Self { version: next_version(), memory: None, filed: OnceLock::new() }
    }
}

impl<B> Clone for Paged<B> {
    fn clone(&self) -> Self {
        Self { version: self.version, memory: self.memory.clone(), filed: self.filed.clone() }
    }
}

impl<B: Block> Deref for Paged<B> {
    type Target = B;

    #[inline]
    fn deref(&self) -> &B {
        match &self.memory {
            Some(block) => block,
            None => self.filed.get_or_init(Arc::default).block(),
        }
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
        let mut block = block.clone();
        block.page_out(file, &mut Vec::new()).unwrap();
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

        block.to_mut().push(10);
        assert!(!block.is_same(&original));
        assert_eq!((&*block, &*original, &*again), (&vec![7, 8, 9, 10], &vec![7, 8, 9], &vec![7, 8, 9]));
        assert!(file.failure().is_none());
    }

    #[test]
    fn a_clone_gives_its_memory_free_only_for_the_same_block() {
        let file = PageFile::create_in(&std::env::temp_dir()).unwrap();
        let original = Paged::new(vec![1]);
        let mut changed = original.clone();
        changed.to_mut().push(2);
        let filed = paged_out(&changed, &file);
        let mut old = original.clone();
        old.page_out_like(&filed);
        assert!(old.in_memory().is_some());
        changed.page_out_like(&filed);
        assert!(changed.in_memory().is_none());
        assert_eq!((&*old, &*changed), (&vec![1], &vec![1, 2]));
    }

    #[test]
    fn an_empty_block_is_changed_like_any_other() {
        let mut block = Paged::<Vec<u32>>::default();
        let clone = block.clone();
        assert!(block.is_empty());
        block.to_mut().push(1);
        assert_eq!((&*block, &*clone), (&vec![1], &vec![]));
    }
}
