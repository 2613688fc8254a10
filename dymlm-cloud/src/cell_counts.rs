use std::sync::Arc;

use crate::block_store::{BLOCK_CELLS, CellBits, for_each_bit};
use crate::finding::{Counts, FINDINGS, Finding};
use crate::packed_counts::PackedCounts;
use crate::paging::record_of_cases;
use crate::plain_counts::PlainCounts;
use crate::support::Support;

/// For each cell of a block, the number of frames by what they found there. Either all cells have counts, or
/// none as long as no cell differs from the others. Arithmetic wraps.
///
/// Most counts of seconds fit into a byte. Counts that no longer grow are [packed](Self::pack), and clones share
/// them.
#[derive(Debug, Clone, Default)]
pub(crate) enum CellCounts {
    #[default]
    None,
    Narrow(Box<PlainCounts<u8>>),
    Wide(Box<PlainCounts<u32>>),
    Packed(Arc<PackedCounts>),
}

record_of_cases!(CellCounts { 0 => None, 1 => Narrow(cells), 2 => Wide(cells), 3 => Packed(cells) });

impl CellCounts {
    pub(crate) fn is_empty(&self) -> bool {
        matches!(self, Self::None)
    }

    #[inline]
    pub(crate) fn get(&self, index: usize) -> Counts {
        match self {
            Self::None => [0; FINDINGS],
            Self::Narrow(cells) => cells.get(index),
            Self::Wide(cells) => cells.get(index),
            Self::Packed(cells) => cells.get(index),
        }
    }

    /// The cells in which a surface or a mover was read.
    pub(crate) fn read(&self) -> CellBits {
        match self {
            Self::None => CellBits::default(),
            Self::Narrow(cells) => *cells.read(),
            Self::Wide(cells) => *cells.read(),
            Self::Packed(cells) => cells.read(),
        }
    }

    #[inline]
    pub(crate) fn support(&self, index: usize) -> Support {
        Support::of(self.get(index))
    }

    /// Calls `visit` for all of the cells that have counts, and perhaps for some that have none.
    pub(crate) fn for_each(&self, cells: &CellBits, mut visit: impl FnMut(usize, Counts)) {
        match self {
            Self::None => {}
            Self::Narrow(_) | Self::Wide(_) => for_each_bit(*cells, |index| visit(index, self.get(index))),
            Self::Packed(packed) => packed.for_each(cells, visit),
        }
    }

    /// The counts, if they are packed.
    pub(crate) fn packed(&self) -> Option<&PackedCounts> {
        match self {
            Self::Packed(packed) => Some(packed),
            Self::None | Self::Narrow(_) | Self::Wide(_) => None,
        }
    }

    /// Packs the counts into less memory, until one changes.
    pub(crate) fn pack(&mut self) {
        let packed = match self {
            Self::None | Self::Packed(_) => return,
            Self::Narrow(cells) => PackedCounts::new(cells),
            Self::Wide(cells) => PackedCounts::new(cells),
        };
        *self = Self::Packed(Arc::new(packed));
    }

    /// Gives all cells counts that can be changed.
    fn open(&mut self) {
        match self {
            Self::None => *self = Self::Narrow(Box::default()),
            Self::Packed(_) => self.unpack(),
            Self::Narrow(_) | Self::Wide(_) => {}
        }
    }

    fn unpack(&mut self) {
        let (packed, mut unpacked) = (self.plain(), Self::Narrow(Box::default()));
        for index in 0..BLOCK_CELLS {
            let counts = packed.get(index);
            if counts != [0; FINDINGS] {
                unpacked.set(index, counts);
            }
        }
        *self = unpacked;
    }

    /// The counts of all cells.
    pub(crate) fn plain(&self) -> PlainCounts<u32> {
        match self {
            Self::None => PlainCounts::default(),
            Self::Narrow(cells) => cells.widened(),
            Self::Wide(cells) => (**cells).clone(),
            Self::Packed(packed) => packed.plain(),
        }
    }

    /// Sets the counts of a cell; all cells have counts from then on.
    #[inline]
    pub(crate) fn set(&mut self, index: usize, counts: Counts) {
        self.open();
        if let Self::Narrow(cells) = self
            && counts.iter().any(|&count| count > u8::MAX.into())
        {
            *self = Self::Wide(Box::new(cells.widened()));
        }
        match self {
            Self::None | Self::Packed(_) => {}
            Self::Narrow(cells) => cells.set(index, counts.map(|count| count as u8)),
            Self::Wide(cells) => cells.set(index, counts),
        }
    }

    /// Adds 1 to a count of some cells.
    pub(crate) fn add_one(&mut self, cells: &CellBits, finding: Finding) {
        if *cells == CellBits::default() {
            return;
        }
        self.open();
        let mut others = *cells;
        if let Self::Narrow(narrow) = self {
            others = narrow.add_one(cells, finding);
        }
        for_each_bit(others, |index| _ = self.add(index, finding, 1));
    }

    /// Adds to a count of a cell; returns what it was.
    #[inline]
    pub(crate) fn add(&mut self, index: usize, finding: Finding, number: u32) -> u32 {
        let mut counts = self.get(index);
        let before = counts[finding as usize];
        counts[finding as usize] = before.wrapping_add(number);
        self.set(index, counts);
        before
    }

    /// Adds the counts of all cells, and [packs](Self::pack) the sums.
    pub(crate) fn add_all(&mut self, other: &Self) {
        if other.is_empty() {
            return;
        }
        let mut sums = self.plain();
        sums.add_all(&other.plain());
        *self = Self::Packed(Arc::new(PackedCounts::new(&sums)));
    }

    /// Sets a count of a cell to zero, if there are counts.
    pub(crate) fn clear(&mut self, index: usize, finding: Finding) {
        if !self.is_empty() {
            let mut counts = self.get(index);
            counts[finding as usize] = 0;
            self.set(index, counts);
        }
    }

    /// Whether a clone has the same counts in the same memory.
    pub(crate) fn is_shared_with(&self, other: &Self) -> bool {
        matches!((self, other), (Self::Packed(own), Self::Packed(other)) if Arc::ptr_eq(own, other))
    }

    /// Bytes that the counts own.
    pub(crate) fn memory_bytes(&self) -> usize {
        match self {
            Self::None => 0,
            Self::Narrow(_) => size_of::<PlainCounts<u8>>(),
            Self::Wide(_) => size_of::<PlainCounts<u32>>(),
            Self::Packed(cells) => 2 * size_of::<usize>() + size_of::<PackedCounts>() + cells.memory_bytes(),
        }
    }
}

impl PartialEq for CellCounts {
    fn eq(&self, other: &Self) -> bool {
        self.is_empty() == other.is_empty()
            && (0..BLOCK_CELLS).all(|index| self.get(index) == other.get(index))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block_store::has;

    #[test]
    fn counts_of_many_cells_are_those_of_each_alone() {
        let (mut together, mut alone) = (CellCounts::None, CellCounts::None);
        for step in 0..700_u64 {
            let cells: CellBits = std::array::from_fn(|word| {
                (step / 90 * 8 + word as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1 << (step % 64)
            });
            let finding = if step % 5 > 0 { Finding::LookedThrough } else { Finding::Mover };
            together.add_one(&cells, finding);
            (0..BLOCK_CELLS).filter(|&index| has(&cells, index)).for_each(|index| {
                alone.add(index, finding, 1);
            });
            assert_eq!((&together, together.read()), (&alone, alone.read()), "{step}");
        }
        assert!(matches!(together, CellCounts::Wide(_)));
    }

    #[test]
    fn clones_share_packed_counts_until_one_changes() {
        let mut counts = CellCounts::None;
        counts.add(3, Finding::LookedThrough, 5);
        assert!(!counts.is_shared_with(&counts.clone()));
        counts.pack();
        let mut clone = counts.clone();
        assert!(counts.is_shared_with(&clone));
        clone.add(3, Finding::LookedThrough, 1);
        assert!(!counts.is_shared_with(&clone));
        assert_eq!([counts.get(3), clone.get(3)].map(|cell| cell[Finding::LookedThrough as usize]), [5, 6]);
    }
}
