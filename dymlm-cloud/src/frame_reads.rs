use crate::block_store::{BlockKey, CellBits};
use crate::slot_numbers::SlotNumbers;

/// Which cells of the evidence the current frame has read, block by block.
#[derive(Debug, Default)]
pub(crate) struct FrameReads {
    /// Numbers of the blocks, by their slots.
    numbers: SlotNumbers,
    /// By these numbers.
    blocks: Vec<BlockReads>,
    /// The block read last, and its number.
    last: Option<(BlockKey, usize)>,
}

/// The cells of a block in which the frame has read a surface, and those in which it has read a mover.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct BlockReads {
    pub(crate) slot: usize,
    pub(crate) surfaces: CellBits,
    pub(crate) movers: CellBits,
}

/// A clone begins empty: maps are cloned between frames.
impl Clone for FrameReads {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl FrameReads {
    /// What was read in the block at `key`; `find_slot` gives its slot.
    #[inline]
    pub(crate) fn of_block(&mut self, key: BlockKey, find_slot: impl FnOnce() -> usize) -> &mut BlockReads {
        // Neighbouring readings mostly share a block.
        let number = match self.last {
            Some((last, number)) if last == key => number,
            _ => self.number(find_slot()),
        };
        self.last = Some((key, number));
        &mut self.blocks[number]
    }

    fn number(&mut self, slot: usize) -> usize {
        let number = self.numbers.number_or_insert(slot);
        if number == self.blocks.len() {
            self.blocks.push(BlockReads { slot, ..BlockReads::default() });
        }
        number
    }

    /// What was read in the block of a slot; `None` when nothing was.
    pub(crate) fn at(&self, slot: usize) -> Option<&BlockReads> {
        self.blocks.get(self.numbers.number(slot)?)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &BlockReads> {
        self.blocks.iter()
    }

    /// Forgets everything, before another frame.
    pub(crate) fn clear(&mut self) {
        self.numbers.clear();
        self.blocks.clear();
        self.last = None;
    }
}
