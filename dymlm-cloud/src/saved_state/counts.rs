use serde::{Deserialize, Serialize};

use crate::block_store::{BLOCK_CELLS, CellBits, count, for_each_bit, put};
use crate::cell_counts::CellCounts;
use crate::finding::{Counts, FINDINGS};

/// More frames than a cell can have counted in a period of three hours. Damaged counts are refused by this
/// limit, before their sums overflow.
const MOST_FRAMES: u32 = 1 << 26;

/// A bit for each cell of a block, in bytes.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedCells([[u8; 8]; BLOCK_CELLS / 64]);

impl SavedCells {
    pub(super) fn of(cells: &CellBits) -> Self {
        Self(cells.map(u64::to_le_bytes))
    }

    pub(super) fn cells(&self) -> CellBits {
        self.0.map(u64::from_le_bytes)
    }

    pub(super) fn len(&self) -> usize {
        count(&self.cells())
    }
}

/// The counts of a block's cells: most cells that have any were looked through by the same number of frames.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedCounts {
    /// Greatest number of looks through a cell in which nothing was read, and the cells that have this
    /// number.
    most: u32,
    looked_through: SavedCells,
    others: SavedCells,
    /// Counts of the other cells, by finding.
    numbers: [Vec<u32>; FINDINGS],
}

impl SavedCounts {
    /// `None` when no cell has counts of its own.
    pub(super) fn of(counts: &CellCounts) -> Option<Self> {
        if counts.is_empty() {
            return None;
        }
        let cells: Vec<Counts> = (0..BLOCK_CELLS).map(|index| counts.get(index)).collect();
        let looks = cells.iter().filter(|[surface, _, mover]| surface | mover == 0);
        let most = looks.map(|[_, looks, _]| *looks).max().unwrap_or(0);
        let (mut looked_through, mut others) = (CellBits::default(), CellBits::default());
        for (index, &counts) in cells.iter().enumerate() {
            if counts == [0, most, 0] {
                put(&mut looked_through, index);
            } else if counts != [0; FINDINGS] {
                put(&mut others, index);
            }
        }
        let mut numbers: [Vec<u32>; FINDINGS] = Default::default();
        for_each_bit(others, |index| {
            for (numbers, number) in numbers.iter_mut().zip(cells[index]) {
                numbers.push(number);
            }
        });
        let (looked_through, others) = (SavedCells::of(&looked_through), SavedCells::of(&others));
        Some(Self { most, looked_through, others, numbers })
    }

    /// `None` for counts that no map can hold.
    pub(super) fn restored(self) -> Option<CellCounts> {
        let all = self.numbers.iter().flatten().chain([&self.most]);
        let is_right = self.numbers.iter().all(|numbers| numbers.len() == self.others.len())
            && all.copied().all(|number| number < MOST_FRAMES);
        if !is_right {
            return None;
        }
        let mut counts = CellCounts::default();
        counts.set(0, [0; FINDINGS]);
        for_each_bit(self.looked_through.cells(), |index| counts.set(index, [0, self.most, 0]));
        let mut next = 0;
        for_each_bit(self.others.cells(), |index| {
            let number = |finding: usize| self.numbers[finding].get(next).copied().unwrap_or(0);
            counts.set(index, std::array::from_fn(number));
            next += 1;
        });
        Some(counts)
    }
}
