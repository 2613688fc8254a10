use crate::block_store::{BLOCK_CELLS, CellBits, for_each_bit, union, without};
use crate::finding::{Counts, FINDINGS, Finding};
use crate::paging::record;

/// For each cell of a block, the number of frames by what they found there, each number in its own place.
#[derive(Debug, Clone)]
pub(crate) struct PlainCounts<N> {
    /// By finding, then by cell.
    counts: [[N; BLOCK_CELLS]; FINDINGS],
    /// The cells in which a surface or a mover was read.
    read: CellBits,
}

record!(PlainCounts<u8> { counts, read });
record!(PlainCounts<u32> { counts, read });

/// The cells of a block by how much must be kept of them: in a period most cells are looked through by every
/// frame or by none.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Partition {
    /// Greatest number of looks through a cell in which nothing was read.
    pub(crate) most: u32,
    /// The cells with this number in which nothing was read.
    pub(crate) looked_through: CellBits,
    /// The other cells that have counts, at surfaces and at the rim of what is in view.
    pub(crate) others: CellBits,
}

impl<N: Copy + Ord + Default + Into<u32>> PlainCounts<N> {
    #[inline]
    pub(crate) fn get(&self, index: usize) -> Counts {
        self.counts.each_ref().map(|counts| counts[index].into())
    }

    #[inline]
    pub(crate) fn set(&mut self, index: usize, counts: [N; FINDINGS]) {
        for (place, count) in self.counts.iter_mut().zip(counts) {
            place[index] = count;
        }
        let [surface, _, mover] = counts.map(Into::into);
        self.read[index / 64] &= !(1 << (index % 64));
        self.read[index / 64] |= u64::from(surface | mover != 0) << (index % 64);
    }

    /// The cells in which a surface or a mover was read.
    pub(crate) fn read(&self) -> &CellBits {
        &self.read
    }

    /// The same counts in wider places.
    pub(crate) fn widened(&self) -> PlainCounts<u32> {
        PlainCounts { counts: self.counts.map(|counts| counts.map(Into::into)), read: self.read }
    }

    /// Which cells are alike.
    pub(crate) fn partition(&self) -> Partition {
        let (words, _) = self.counts[Finding::LookedThrough as usize].as_chunks::<64>();
        let greatest = |most: N, (looks, read): (&[N; 64], &u64)| match read {
            0 => looks.iter().copied().fold(most, N::max),
            _ => (0..64).filter(|cell| read >> cell & 1 == 0).map(|cell| looks[cell]).fold(most, N::max),
        };
        let most = words.iter().zip(&self.read).fold(N::default(), greatest);
        let (mut looked_through, mut others) = (CellBits::default(), self.read);
        for (word, looks) in words.iter().enumerate() {
            let has_looks = cells_where(looks, |looks| looks != N::default());
            let has_most = cells_where(looks, |looks| looks == most);
            looked_through[word] = has_looks & has_most & !self.read[word];
            others[word] |= has_looks & !has_most;
        }
        Partition { most: most.into(), looked_through, others }
    }
}

/// The cells of a word whose numbers are as chosen.
#[inline]
fn cells_where<N: Copy>(numbers: &[N; 64], is_chosen: impl Fn(N) -> bool) -> u64 {
    numbers.iter().enumerate().fold(0, |cells, (cell, &number)| cells | u64::from(is_chosen(number)) << cell)
}

impl<N: Copy + Default> Default for PlainCounts<N> {
    fn default() -> Self {
        Self { counts: [[N::default(); BLOCK_CELLS]; FINDINGS], read: CellBits::default() }
    }
}

impl PlainCounts<u32> {
    /// Adds the counts of all cells; the sums wrap.
    pub(crate) fn add_all(&mut self, other: &Self) {
        for (sums, counts) in self.counts.iter_mut().zip(&other.counts) {
            sums.iter_mut().zip(counts).for_each(|(sum, count)| *sum = sum.wrapping_add(*count));
        }
        let [surfaces, _, movers] = &self.counts;
        let (mut read, both) = (CellBits::default(), union(self.read, other.read));
        for_each_bit(both, |index| {
            read[index / 64] |= u64::from(surfaces[index] | movers[index] != 0) << (index % 64);
        });
        self.read = read;
    }
}

impl PlainCounts<u8> {
    /// Adds 1 to a count of some cells, a row of eight at a time. Returns the cells that are left: those of
    /// rows in which a count would not fit.
    pub(crate) fn add_one(&mut self, cells: &CellBits, finding: Finding) -> CellBits {
        let mut left = CellBits::default();
        let (rows, _) = self.counts[finding as usize].as_chunks_mut::<8>();
        for (index, row) in rows.iter_mut().enumerate() {
            let (word, shift) = (index / 8, 8 * (index % 8));
            let chosen = cells[word] >> shift & 0xFF;
            let (counts, ones) = (u64::from_le_bytes(*row), bytes_of_bits(chosen));
            if is_any_full(counts, ones) {
                left[word] |= chosen << shift;
            } else {
                *row = (counts + ones).to_le_bytes();
            }
        }
        if finding != Finding::LookedThrough {
            self.read = union(self.read, without(*cells, left));
        }
        left
    }
}

/// Eight bytes, each with the value of one of the lowest eight bits.
#[inline]
fn bytes_of_bits(bits: u64) -> u64 {
    // Each byte gets its own bit of a copy of all eight, which then moves to the byte's lowest place.
    let apart = (bits * 0x0101_0101_0101_0101) & 0x8040_2010_0804_0201;
    (apart + 0x7F7F_7F7F_7F7F_7F7F) >> 7 & 0x0101_0101_0101_0101
}

/// Whether any of eight bytes is 255 where the byte in `ones` is 1.
#[inline]
fn is_any_full(bytes: u64, ones: u64) -> bool {
    let has_low_carry = (bytes & 0x7F7F_7F7F_7F7F_7F7F) + ones;
    has_low_carry & bytes & 0x8080_8080_8080_8080 != 0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::block_store::has;

    #[test]
    fn cells_are_parted_by_what_was_read_in_them_and_how_often_they_were_looked_through() {
        let mut counts = PlainCounts::<u8>::default();
        for index in 0..BLOCK_CELLS {
            let looks = [0, 4, 4, 3][index % 4];
            // More looks than anywhere else do not count where something was read.
            counts.set(index, if index % 64 == 2 && index < 256 { [1, 9, 0] } else { [0, looks, 0] });
        }
        let Partition { most, looked_through, others } = counts.partition();
        assert_eq!(most, 4);
        for index in 0..BLOCK_CELLS {
            let is_read = index % 64 == 2 && index < 256;
            assert_eq!(has(&looked_through, index), !is_read && matches!(index % 4, 1 | 2), "{index}");
            assert_eq!(has(&others, index), is_read || index % 4 == 3, "{index}");
        }
    }

    #[test]
    fn what_is_taken_out_again_was_not_read() {
        let mut sums = PlainCounts::<u32>::default();
        sums.set(7, [2, 3, 0]);
        sums.set(8, [0, 0, 1]);
        let mut out = PlainCounts::<u32>::default();
        out.set(7, [2_u32.wrapping_neg(), 1, 0]);
        sums.add_all(&out);
        assert_eq!((sums.get(7), sums.get(8)), ([0, 4, 0], [0, 0, 1]));
        assert!(!has(sums.read(), 7) && has(sums.read(), 8));
    }
}
