use dymlm_core::BitWriter;

use crate::block_store::{BLOCK_CELLS, CellBits, for_each_bit, has, put};
use crate::finding::{Counts, FINDINGS, Finding};
use crate::paging::record;
use crate::places::Places;
use crate::plain_counts::{Partition, PlainCounts};

/// The counts of a block's cells in little memory, for reading only: cells that are [alike](Partition) take two
/// bits, the others keep their numbers.
#[derive(Debug, Clone)]
pub(crate) struct PackedCounts {
    /// Greatest number of looks through a cell in which nothing was read, and the cells that have this
    /// number.
    most: u32,
    looked_through: CellBits,
    others: Places,
    /// Bits of each number of the other cells, by finding; and the numbers, one after the other.
    widths: [u8; FINDINGS],
    numbers: Box<[u64]>,
}

record!(PackedCounts { most, looked_through, others, widths, numbers });

impl PackedCounts {
    pub(crate) fn new<N: Copy + Ord + Default + Into<u32>>(counts: &PlainCounts<N>) -> Self {
        let Partition { most, looked_through, others } = counts.partition();
        let mut all = [0; FINDINGS];
        for_each_bit(others, |index| {
            let counts = counts.get(index);
            all = std::array::from_fn(|finding| all[finding] | counts[finding]);
        });
        let widths = all.map(|all: u32| (u32::BITS - all.leading_zeros()) as u8);
        let others = Places::new(others);
        let bits = others.len() * widths.iter().map(|&width| usize::from(width)).sum::<usize>();
        let mut numbers = BitWriter::with_capacity(bits.div_ceil(8));
        for_each_bit(*others.cells(), |index| {
            for (count, width) in counts.get(index).into_iter().zip(widths) {
                numbers.put(count, width.into());
            }
        });
        Self { most, looked_through, others, widths, numbers: numbers.into_words().into() }
    }

    #[inline]
    pub(crate) fn get(&self, index: usize) -> Counts {
        let mut counts = [0; FINDINGS];
        if has(&self.looked_through, index) {
            counts[Finding::LookedThrough as usize] = self.most;
        } else if self.others.has(index) {
            return self.numbers_of(self.others.rank(index));
        }
        counts
    }

    /// Greatest number of looks through a cell in which nothing was read.
    #[inline]
    pub(crate) fn most(&self) -> u32 {
        self.most
    }

    /// Reads a number of each line of memory that the counts take.
    #[inline]
    pub(crate) fn touch_numbers(&self) -> u64 {
        const LINE: usize = 64 / size_of::<u64>();
        self.numbers.iter().step_by(LINE).fold(0, |all, numbers| all ^ numbers)
    }

    /// The counts of all cells.
    pub(crate) fn plain(&self) -> PlainCounts<u32> {
        let mut counts = PlainCounts::default();
        self.for_each(&[u64::MAX; BLOCK_CELLS / 64], |index, cell| counts.set(index, cell));
        counts
    }

    /// The cells in which a surface or a mover was read.
    pub(crate) fn read(&self) -> CellBits {
        let mut read = CellBits::default();
        let [surface, _, mover] = self.widths;
        if surface | mover == 0 {
            return read;
        }
        self.others.for_each(self.others.cells(), |index, rank| {
            let [surface, _, mover] = self.numbers_of(rank);
            if surface | mover != 0 {
                put(&mut read, index);
            }
        });
        read
    }

    /// Bytes that the counts own.
    pub(crate) fn memory_bytes(&self) -> usize {
        size_of_val(&*self.numbers)
    }

    /// Calls `visit` for those of the cells that have counts.
    pub(crate) fn for_each(&self, cells: &CellBits, mut visit: impl FnMut(usize, Counts)) {
        for_each_bit(cells.iter().zip(&self.looked_through).map(|(cells, looked)| cells & looked), |index| {
            visit(index, [0, self.most, 0]);
        });
        self.others.for_each(cells, |index, rank| visit(index, self.numbers_of(rank)));
    }

    #[inline]
    fn numbers_of(&self, rank: usize) -> Counts {
        let widths = self.widths.map(u32::from);
        let bits = widths.iter().sum::<u32>();
        let at = rank * bits as usize;
        let word = |index: usize| self.numbers.get(index).copied().unwrap_or(0);
        let shift = at as u32 % 64;
        // The next word's bits follow; shifted in two steps, since a shift by 64 bits would overflow.
        let from = |index: usize| word(index) >> shift | word(index + 1) << 1 << (63 - shift);
        let mut record = u128::from(from(at / 64));
        if bits > 64 {
            record |= u128::from(from(at / 64 + 1)) << 64;
        }
        widths.map(|width| {
            let number = record as u64 & ((1 << width) - 1);
            record >>= width;
            number as u32
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn packed_counts_are_what_they_were_and_take_less() {
        for largest in [1, 12, 255, 256, 70_000, u32::MAX] {
            for movers in [0, 1] {
                let counts = |index: usize| match index % 7 {
                    0 | 1 => [0; FINDINGS],
                    2..=5 => [0, largest, 0],
                    _ => [
                        largest - (index as u32).min(largest),
                        (index as u32 % 5).min(largest),
                        movers * index as u32 % 3,
                    ],
                };
                let mut plain = PlainCounts::<u32>::default();
                (0..BLOCK_CELLS).for_each(|index| plain.set(index, counts(index)));
                let packed = PackedCounts::new(&plain);
                for index in 0..BLOCK_CELLS {
                    assert_eq!(packed.get(index), counts(index), "{largest}, cell {index}");
                    let [surface, _, mover] = counts(index);
                    assert_eq!(has(&packed.read(), index), surface | mover != 0);
                }
                let mut visited = [[0; FINDINGS]; BLOCK_CELLS];
                packed.for_each(&[u64::MAX; BLOCK_CELLS / 64], |index, counts| visited[index] = counts);
                assert!((0..BLOCK_CELLS).all(|index| visited[index] == counts(index)));
                // Unpacked, a cell takes three numbers of `width` bytes.
                let width = (1..4).find(|width| largest >> (8 * width) == 0).unwrap_or(4);
                assert!(size_of::<PackedCounts>() + packed.memory_bytes() < BLOCK_CELLS * (width + 2) / 4);
            }
        }
    }
}
