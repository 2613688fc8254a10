use crate::block_store::{BLOCK_CELLS, CellBits, has, put};
use crate::cell_counts::{Counts, FINDINGS, Finding};
use crate::places::Places;

/// The counts of a block's cells in little memory, for reading only.
///
/// In a stretch of time most cells are looked through by each frame or by none: these take a bit. The others,
/// at surfaces and at the rim of what is in view, keep their numbers.
#[derive(Debug, Clone)]
pub(crate) struct PackedCounts {
    /// Frames that look through the cells that most look through, and which these are.
    most: u32,
    looked_through: CellBits,
    others: Places,
    /// Bytes of a number of these, little end first.
    width: u8,
    /// Numbers of each: there is none of movers when no cell has any.
    findings: u8,
    numbers: Box<[u8]>,
}

impl PackedCounts {
    pub(crate) fn new(counts: impl Fn(usize) -> Counts) -> Self {
        let cells = || (0..BLOCK_CELLS).map(|index| (index, counts(index)));
        let free =
            |[surface, looked_through, mover]: Counts| (surface | mover == 0).then_some(looked_through);
        let most = cells().filter_map(|(_, counts)| free(counts)).max().unwrap_or(0);
        let (mut looked_through, mut others) = (CellBits::default(), CellBits::default());
        let (mut all, mut movers) = (0, 0);
        for (index, counts) in cells() {
            match free(counts) {
                Some(0) => {}
                Some(looks) if looks == most => put(&mut looked_through, index),
                _ => {
                    put(&mut others, index);
                    all |= counts.into_iter().fold(0, |all, count| all | count);
                    movers |= counts[Finding::Mover as usize];
                }
            }
        }
        let width = (size_of::<u32>() - all.leading_zeros() as usize / 8).max(1);
        let findings = if movers == 0 { Finding::Mover as usize } else { FINDINGS };
        let others = Places::new(others);
        let mut numbers = Vec::with_capacity(others.len() * width * findings);
        for (_, counts) in cells().filter(|(index, _)| others.has(*index)) {
            for count in counts.into_iter().take(findings) {
                numbers.extend_from_slice(&count.to_le_bytes()[..width]);
            }
        }
        let (width, findings) = (width as u8, findings as u8);
        Self { most, looked_through, others, width, findings, numbers: numbers.into() }
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

    /// Bytes owned.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.numbers.len()
    }

    #[inline]
    fn numbers_of(&self, rank: usize) -> Counts {
        let (width, findings) = (usize::from(self.width), usize::from(self.findings));
        let mut counts = [0; FINDINGS];
        let numbers = self.numbers.chunks_exact(width).skip(rank * findings).take(findings);
        for (count, bytes) in counts.iter_mut().zip(numbers) {
            *count = bytes.iter().rev().fold(0, |number, &byte| number << 8 | u32::from(byte));
        }
        counts
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
                let packed = PackedCounts::new(counts);
                for index in 0..BLOCK_CELLS {
                    assert_eq!(packed.get(index), counts(index), "{largest}, cell {index}");
                    let [surface, _, mover] = counts(index);
                    assert_eq!(has(&packed.read(), index), surface | mover != 0);
                }
                let width = (1..4).find(|width| largest >> (8 * width) == 0).unwrap_or(4);
                assert!(size_of::<PackedCounts>() + packed.memory_bytes() < BLOCK_CELLS * (width + 1) / 2);
            }
        }
    }
}
