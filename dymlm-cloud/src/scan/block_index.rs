use std::collections::HashMap;
use std::hash::BuildHasherDefault;

use crate::block_store::BlockKey;
use crate::slot_index::KeyHasher;

/// Slots of blocks by their place, numbered from 0; a slot does not change. O(1) expected a look-up.
#[derive(Debug, Clone, Default)]
pub(super) struct BlockIndex {
    slots: HashMap<BlockKey, u32, BuildHasherDefault<KeyHasher>>,
    keys: Vec<BlockKey>,
}

impl BlockIndex {
    /// The slot of the block at `key`; the next free one when it has none yet.
    #[inline]
    pub(super) fn slot_or_insert(&mut self, key: BlockKey) -> usize {
        let next = self.keys.len();
        let slot = *self.slots.entry(key).or_insert(next as u32) as usize;
        if slot == next {
            self.keys.push(key);
        }
        slot
    }

    /// Keys by slot.
    #[inline]
    pub(super) fn keys(&self) -> &[BlockKey] {
        &self.keys
    }

    /// Forgets all blocks, and keeps the memory.
    pub(super) fn clear(&mut self) {
        self.slots.clear();
        self.keys.clear();
    }
}
