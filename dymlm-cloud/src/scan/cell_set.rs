use super::block_index::BlockIndex;
use crate::block_store::{BlockKey, CellBits, put};

/// A set of cells of the evidence, block by block. Clearing it keeps its memory.
#[derive(Debug, Clone, Default)]
pub(super) struct CellSet {
    index: BlockIndex,
    /// By slot.
    cells: Vec<CellBits>,
}

impl CellSet {
    pub(super) fn clear(&mut self) {
        self.index.clear();
        self.cells.clear();
    }

    /// The slot of a block, made when there is none.
    pub(super) fn slot_or_insert(&mut self, key: BlockKey) -> usize {
        let slot = self.index.slot_or_insert(key);
        if slot == self.cells.len() {
            self.cells.push(CellBits::default());
        }
        slot
    }

    /// Puts a cell in, by the slot of its block and its index there.
    #[inline]
    pub(super) fn put(&mut self, slot: usize, index: usize) {
        put(&mut self.cells[slot], index);
    }

    /// The cells by blocks.
    pub(super) fn blocks(&self) -> impl Iterator<Item = (BlockKey, CellBits)> {
        self.index.keys().iter().copied().zip(self.cells.iter().copied())
    }
}
