use dymlm_core::Pages;

use crate::block_store::{BlockKey, BlockStore};
use crate::paging::{Block, Paged, Version};
use crate::slot_index::SlotIndex;
use crate::stamps::Stamps;

/// The blocks of a store that was saved: which there were, in which versions, but not what was in them.
#[derive(Debug)]
pub(super) struct SavedBlocks {
    index: SlotIndex,
    keys: Pages<BlockKey>,
    /// By slot.
    versions: Vec<Version>,
    stamps: Stamps,
}

impl SavedBlocks {
    pub(super) fn of<B: Block>(store: &BlockStore<B>) -> Self {
        Self {
            index: store.index().clone(),
            keys: store.keys().clone(),
            versions: store.blocks().iter().map(Paged::version).collect(),
            stamps: store.stamps().clone(),
        }
    }

    /// Keys of the blocks in which a later state of the store differs, also of those that are gone.
    pub(super) fn changed_in<'a, B: Block>(
        &'a self,
        later: &'a BlockStore<B>,
    ) -> impl Iterator<Item = BlockKey> + 'a {
        let version = |key: BlockKey| self.versions.get(self.index.slot(key)?);
        let blocks = later.keys().iter().copied().zip(later.blocks().iter());
        let changed = blocks.filter(move |(key, block)| version(*key).is_none_or(|old| !block.is_in(old)));
        let gone = self.keys.unshared(later.keys()).map(|slot| self.keys[slot]);
        changed.map(|(key, _)| key).chain(gone.filter(|key| later.slot(*key).is_none()))
    }

    /// Blocks of which a later state of the store has noted another last change.
    pub(super) fn noted_in<'a, B: Block>(
        &'a self,
        later: &'a BlockStore<B>,
    ) -> impl Iterator<Item = BlockKey> + 'a {
        let slots = later.stamps().unshared(&self.stamps);
        let noted = slots.filter_map(|slot| Some((*later.keys().get(slot)?, later.stamps().of(slot))));
        let is_new = |key, stamp| self.index.slot(key).is_none_or(|slot| self.stamps.of(slot) != stamp);
        noted.filter(move |(key, stamp)| is_new(*key, *stamp)).map(|(key, _)| key)
    }

    /// Approximate bytes.
    pub(super) fn memory_bytes(&self) -> usize {
        self.index.memory_bytes_beside(&SlotIndex::default())
            + self.keys.memory_bytes()
            + self.versions.len() * size_of::<Version>()
            + self.stamps.memory_bytes_beside(&Stamps::default())
    }
}
