use std::ops::Range;

use crate::block_store::{BLOCK_CELLS, CellBits, count, has, put};
use crate::paging::record;

/// Some cells of a block, each with its rank: the number of these cells before it.
#[derive(Debug, Clone, Default)]
pub(crate) struct Places {
    cells: CellBits,
    /// For each word, the number of cells before it.
    before: [u16; BLOCK_CELLS / 64],
}

record!(Places { cells, before });

impl Places {
    pub(crate) fn new(cells: CellBits) -> Self {
        let (mut before, mut count) = ([0; BLOCK_CELLS / 64], 0);
        for (before, word) in before.iter_mut().zip(cells) {
            *before = count;
            count += word.count_ones() as u16;
        }
        Self { cells, before }
    }

    #[inline]
    pub(crate) fn cells(&self) -> &CellBits {
        &self.cells
    }

    pub(crate) fn len(&self) -> usize {
        count(&self.cells)
    }

    #[inline]
    pub(crate) fn has(&self, place: usize) -> bool {
        has(&self.cells, place)
    }

    #[inline]
    pub(crate) fn rank(&self, place: usize) -> usize {
        let below = self.cells[place / 64] & ((1 << (place % 64)) - 1);
        usize::from(self.before[place / 64]) + below.count_ones() as usize
    }

    /// Adds a cell that is not among them.
    pub(crate) fn insert(&mut self, place: usize) {
        put(&mut self.cells, place);
        self.before.iter_mut().skip(place / 64 + 1).for_each(|before| *before += 1);
    }

    /// Calls `visit` with the place and the rank of each of these cells that is also chosen, by place.
    #[inline]
    pub(crate) fn for_each(&self, chosen: &CellBits, visit: impl FnMut(usize, usize)) {
        self.for_each_in(0..chosen.len(), |layer| chosen[layer], visit);
    }

    /// The same for chosen cells that are given layer by layer: a layer is a word.
    #[inline]
    pub(crate) fn for_each_in(
        &self,
        layers: Range<usize>,
        chosen: impl Fn(usize) -> u64,
        mut visit: impl FnMut(usize, usize),
    ) {
        for word in layers {
            let all = self.cells[word];
            let mut bits = chosen(word) & all;
            if bits == 0 {
                continue;
            }
            // As long as no voxel is left out, each rank is the next.
            let (before, is_whole, in_rows) = (usize::from(self.before[word]), bits == all, sums_before(all));
            let mut next = before;
            while bits != 0 {
                let place = bits.trailing_zeros();
                bits &= bits - 1;
                let rank = if is_whole { next } else { before + rank_in_word(all, in_rows, place) };
                next += 1;
                visit(64 * word + place as usize, rank);
            }
        }
    }
}

/// Number of ones of a word below a place; `in_rows`: [`sums_before`] of the word.
#[inline]
fn rank_in_word(word: u64, in_rows: u64, place: u32) -> usize {
    let (row, x) = (place & !7, place & 7);
    let in_row = (word >> row) as u8 & ((1 << x) - 1);
    (in_rows >> row & 0xFF) as usize + in_row.count_ones() as usize
}

/// For each byte of a word the number of ones in the bytes below.
#[inline]
fn sums_before(word: u64) -> u64 {
    let pairs = word - (word >> 1 & 0x5555_5555_5555_5555);
    let quads = (pairs & 0x3333_3333_3333_3333) + (pairs >> 2 & 0x3333_3333_3333_3333);
    let bytes = (quads + (quads >> 4)) & 0x0F0F_0F0F_0F0F_0F0F;
    // The product sums each byte and those below it.
    bytes.wrapping_mul(0x0101_0101_0101_0101) << 8
}
