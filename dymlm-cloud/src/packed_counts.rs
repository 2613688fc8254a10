use crate::block_store::{BLOCK_CELLS, CellBits, for_each_bit, has, put};
use crate::finding::{Counts, FINDINGS, Finding};
use crate::paging::record;
use crate::places::Places;

/// The counts of a block's cells in little memory, for reading only.
///
/// In a period most cells are looked through by every frame or by none: these take two bits. The other cells,
/// at surfaces and at the rim of what is in view, keep their numbers.
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
    pub(crate) fn new(counts: &[Counts; BLOCK_CELLS]) -> Self {
        let cells = || counts.iter().copied().enumerate();
        let free =
            |[surface, looked_through, mover]: Counts| (surface | mover == 0).then_some(looked_through);
        let most = cells().filter_map(|(_, counts)| free(counts)).max().unwrap_or(0);
        let (mut looked_through, mut others) = (CellBits::default(), CellBits::default());
        let mut all = [0; FINDINGS];
        for (index, counts) in cells() {
            match free(counts) {
                Some(0) => {}
                Some(looks) if looks == most => put(&mut looked_through, index),
                _ => {
                    put(&mut others, index);
                    all = std::array::from_fn(|finding| all[finding] | counts[finding]);
                }
            }
        }
        let widths = all.map(|all: u32| (u32::BITS - all.leading_zeros()) as u8);
        let (others, bits) =
            (Places::new(others), widths.iter().map(|&width| usize::from(width)).sum::<usize>());
        let mut numbers = vec![0_u64; (others.len() * bits).div_ceil(64)];
        let mut at = 0;
        for (_, counts) in cells().filter(|(index, _)| others.has(*index)) {
            for (count, width) in counts.into_iter().zip(widths) {
                let (word, shift) = (at / 64, at % 64);
                at += usize::from(width);
                // A number may go on in the next word.
                let spread = u128::from(count) << shift;
                let parts = [spread as u64, (spread >> 64) as u64];
                numbers.iter_mut().skip(word).zip(parts).for_each(|(word, part)| *word |= part);
            }
        }
        Self { most, looked_through, others, widths, numbers: numbers.into() }
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

    /// The cells in which a surface or a mover was read.
    pub(crate) fn read(&self) -> CellBits {
        let mut read = CellBits::default();
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
                let packed = PackedCounts::new(&std::array::from_fn(counts));
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
