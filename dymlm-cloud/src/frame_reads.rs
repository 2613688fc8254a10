use crate::block_store::{BlockKey, CellBits};

/// Which cells of the evidence the current frame has read, block by block.
#[derive(Debug, Default)]
pub(crate) struct FrameReads {
    blocks: Vec<BlockReads>,
    /// By slot of a block: 1 + the block's place in `blocks`, or 0.
    places: Vec<u32>,
    /// The block read last, and its place.
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
        let place = match self.last {
            Some((last, place)) if last == key => place,
            _ => self.find(find_slot()),
        };
        self.last = Some((key, place));
        &mut self.blocks[place]
    }

    fn find(&mut self, slot: usize) -> usize {
        if slot >= self.places.len() {
            self.places.resize(slot + 1, 0);
        }
        if self.places[slot] == 0 {
            self.blocks.push(BlockReads { slot, ..BlockReads::default() });
            self.places[slot] = self.blocks.len() as u32;
        }
        self.places[slot] as usize - 1
    }

    /// What was read in the block of a slot; `None` when nothing was.
    pub(crate) fn at(&self, slot: usize) -> Option<&BlockReads> {
        let place = (*self.places.get(slot)? as usize).checked_sub(1)?;
        self.blocks.get(place)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &BlockReads> {
        self.blocks.iter()
    }

    /// Forgets everything, before another frame.
    pub(crate) fn clear(&mut self) {
        for block in self.blocks.drain(..) {
            self.places[block.slot] = 0;
        }
        self.last = None;
    }
}
