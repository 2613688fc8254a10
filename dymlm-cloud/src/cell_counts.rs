use crate::block_store::{BLOCK_CELLS, CellBits, for_each_bit};
use crate::finding::{Counts, FINDINGS, Finding};
use crate::packed_counts::PackedCounts;
use crate::paging::{record, record_of_cases};
use crate::support::Support;

/// For each cell of a block, the number of frames by what they found there. Either all cells have counts, or
/// none as long as no cell differs from the others. Arithmetic wraps.
///
/// Most counts of seconds fit into a byte. Counts that no longer grow are [packed](Self::pack).
#[derive(Debug, Clone, Default)]
pub(crate) enum CellCounts {
    #[default]
    None,
    Narrow(Box<Cells<u8>>),
    Wide(Box<Cells<u32>>),
    Packed(Box<PackedCounts>),
}

#[derive(Debug, Clone)]
pub(crate) struct Cells<N> {
    counts: [[N; FINDINGS]; BLOCK_CELLS],
    /// The cells in which a surface or a mover was read.
    read: CellBits,
}

record!(Cells<u8> { counts, read });
record!(Cells<u32> { counts, read });
record_of_cases!(CellCounts { 0 => None, 1 => Narrow(cells), 2 => Wide(cells), 3 => Packed(cells) });

impl CellCounts {
    pub(crate) fn is_empty(&self) -> bool {
        matches!(self, Self::None)
    }

    #[inline]
    pub(crate) fn get(&self, index: usize) -> Counts {
        match self {
            Self::None => [0; FINDINGS],
            Self::Narrow(cells) => cells.counts[index].map(u32::from),
            Self::Wide(cells) => cells.counts[index],
            Self::Packed(cells) => cells.get(index),
        }
    }

    /// The cells in which a surface or a mover was read.
    pub(crate) fn read(&self) -> CellBits {
        match self {
            Self::None => CellBits::default(),
            Self::Narrow(cells) => cells.read,
            Self::Wide(cells) => cells.read,
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

    /// Packs the counts into less memory, until one changes.
    pub(crate) fn pack(&mut self) {
        if matches!(self, Self::Narrow(_) | Self::Wide(_)) {
            *self = Self::Packed(Box::new(PackedCounts::new(&self.all())));
        }
    }

    fn unpack(&mut self) {
        let packed = std::mem::take(self);
        self.set(0, packed.get(0));
        for (index, counts) in packed.all().into_iter().enumerate().skip(1) {
            if counts != [0; FINDINGS] {
                self.set(index, counts);
            }
        }
    }

    /// The counts of all cells.
    fn all(&self) -> [Counts; BLOCK_CELLS] {
        match self {
            Self::None => [[0; FINDINGS]; BLOCK_CELLS],
            Self::Narrow(cells) => cells.counts.map(|cell| cell.map(u32::from)),
            Self::Wide(cells) => cells.counts,
            Self::Packed(packed) => {
                let mut counts = [[0; FINDINGS]; BLOCK_CELLS];
                packed.for_each(&[u64::MAX; BLOCK_CELLS / 64], |index, cell| counts[index] = cell);
                counts
            }
        }
    }

    /// Sets the counts of a cell; all cells have counts from then on.
    #[inline]
    pub(crate) fn set(&mut self, index: usize, counts: Counts) {
        if matches!(self, Self::Packed(_)) {
            self.unpack();
        }
        if self.is_empty() {
            let counts = [[0; FINDINGS]; BLOCK_CELLS];
            *self = Self::Narrow(Box::new(Cells { counts, read: CellBits::default() }));
        }
        if let Self::Narrow(cells) = self
            && counts.iter().any(|&count| count > u8::MAX.into())
        {
            let counts = cells.counts.map(|cell| cell.map(u32::from));
            *self = Self::Wide(Box::new(Cells { counts, read: cells.read }));
        }
        let read = match self {
            Self::None | Self::Packed(_) => return,
            Self::Narrow(cells) => {
                cells.counts[index] = counts.map(|count| count as u8);
                &mut cells.read
            }
            Self::Wide(cells) => {
                cells.counts[index] = counts;
                &mut cells.read
            }
        };
        let [surface, _, mover] = counts;
        read[index / 64] &= !(1 << (index % 64));
        read[index / 64] |= u64::from(surface | mover != 0) << (index % 64);
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
        let mut sums = self.all();
        for (sum, counts) in sums.iter_mut().zip(other.all()) {
            *sum = std::array::from_fn(|finding| sum[finding].wrapping_add(counts[finding]));
        }
        *self = Self::Packed(Box::new(PackedCounts::new(&sums)));
    }

    /// Sets a count of a cell to zero, if there are counts.
    pub(crate) fn clear(&mut self, index: usize, finding: Finding) {
        if !self.is_empty() {
            let mut counts = self.get(index);
            counts[finding as usize] = 0;
            self.set(index, counts);
        }
    }

    /// Bytes that the counts own.
    pub(crate) fn memory_bytes(&self) -> usize {
        match self {
            Self::None => 0,
            Self::Narrow(_) => size_of::<Cells<u8>>(),
            Self::Wide(_) => size_of::<Cells<u32>>(),
            Self::Packed(cells) => size_of::<PackedCounts>() + cells.memory_bytes(),
        }
    }
}

impl PartialEq for CellCounts {
    fn eq(&self, other: &Self) -> bool {
        self.is_empty() == other.is_empty()
            && (0..BLOCK_CELLS).all(|index| self.get(index) == other.get(index))
    }
}
