use crate::block_store::{BLOCK_CELLS, CellBits};
use crate::evidence::Support;

/// What a frame has found in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Finding {
    Surface,
    LookedThrough,
    Mover,
}

/// For each cell of a block, how many frames have found what there: for all cells, or for none as long as no
/// cell differs from the others. Arithmetic wraps.
///
/// Most counts fit into a byte: a period of seconds has few frames, and of what is near the camera for minutes
/// there is little.
#[derive(Debug, Clone, Default)]
pub(crate) enum CellCounts {
    #[default]
    None,
    Narrow(Box<Cells<u8>>),
    Wide(Box<Cells<u16>>),
}

const FINDINGS: usize = 3;

#[derive(Debug, Clone)]
pub(crate) struct Cells<N> {
    counts: [[N; FINDINGS]; BLOCK_CELLS],
    /// The cells in which a surface or a mover was read.
    read: CellBits,
}

impl CellCounts {
    pub(crate) fn is_empty(&self) -> bool {
        matches!(self, Self::None)
    }

    /// The counts of a cell, by [`Finding`].
    #[inline]
    fn get(&self, index: usize) -> [u16; FINDINGS] {
        match self {
            Self::None => [0; FINDINGS],
            Self::Narrow(cells) => cells.counts[index].map(u16::from),
            Self::Wide(cells) => cells.counts[index],
        }
    }

    /// The cells in which a surface or a mover was read.
    pub(crate) fn read(&self) -> CellBits {
        match self {
            Self::None => CellBits::default(),
            Self::Narrow(cells) => cells.read,
            Self::Wide(cells) => cells.read,
        }
    }

    #[inline]
    pub(crate) fn support(&self, index: usize) -> Support {
        let [support, looked_through, movers] = self.get(index).map(u32::from);
        Support { support, looked_through, movers }
    }

    /// Sets the counts of a cell; all cells have counts from then on.
    #[inline]
    fn set(&mut self, index: usize, counts: [u16; FINDINGS]) {
        if self.is_empty() {
            let counts = [[0; FINDINGS]; BLOCK_CELLS];
            *self = Self::Narrow(Box::new(Cells { counts, read: CellBits::default() }));
        }
        if let Self::Narrow(cells) = self
            && counts.iter().any(|&count| count > u8::MAX.into())
        {
            let counts = cells.counts.map(|cell| cell.map(u16::from));
            *self = Self::Wide(Box::new(Cells { counts, read: cells.read }));
        }
        let read = match self {
            Self::None => return,
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

    /// Changes a count of a cell; gives what it was.
    #[inline]
    pub(crate) fn add(&mut self, index: usize, finding: Finding, number: u16) -> u16 {
        let mut counts = self.get(index);
        let before = counts[finding as usize];
        counts[finding as usize] = before.wrapping_add(number);
        self.set(index, counts);
        before
    }

    /// Adds the counts of all cells.
    pub(crate) fn add_all(&mut self, other: &Self) {
        if other.is_empty() {
            return;
        }
        for index in 0..BLOCK_CELLS {
            let (ours, theirs) = (self.get(index), other.get(index));
            self.set(index, std::array::from_fn(|finding| ours[finding].wrapping_add(theirs[finding])));
        }
    }

    /// Sets a count of a cell to zero, if cells have counts.
    pub(crate) fn clear(&mut self, index: usize, finding: Finding) {
        if !self.is_empty() {
            let mut counts = self.get(index);
            counts[finding as usize] = 0;
            self.set(index, counts);
        }
    }

    /// Bytes owned.
    pub(crate) fn memory_bytes(&self) -> usize {
        match self {
            Self::None => 0,
            Self::Narrow(_) => size_of::<Cells<u8>>(),
            Self::Wide(_) => size_of::<Cells<u16>>(),
        }
    }
}

impl PartialEq for CellCounts {
    fn eq(&self, other: &Self) -> bool {
        self.is_empty() == other.is_empty()
            && (0..BLOCK_CELLS).all(|index| self.get(index) == other.get(index))
    }
}
