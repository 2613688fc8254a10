use dymlm_core::{BitReader, BitWriter};

use super::MOST_FRAMES;
use super::cells::{next_cells, put_cells};
use super::number_code::NumberCode;
use crate::block_store::for_each_bit;
use crate::cell_counts::CellCounts;
use crate::finding::{Counts, FINDINGS};
use crate::plain_counts::Partition;

/// Appends the counts of a block's cells: most cells that have any were looked through by the same number of
/// frames.
pub(super) fn put_counts(counts: &CellCounts, bits: &mut BitWriter) {
    bits.put(counts.is_empty().into(), 1);
    if counts.is_empty() {
        return;
    }
    let cells = counts.plain();
    let Partition { most, looked_through, others } = cells.partition();
    bits.put(most, u32::BITS);
    put_cells(&looked_through, bits);
    put_cells(&others, bits);
    let mut code = CountsCode::default();
    for_each_bit(others, |index| code.put(cells.get(index), bits));
}

/// The next counts; `None` for counts that no map can hold, or when there are no more bits.
pub(super) fn next_counts(bits: &mut BitReader<'_>) -> Option<CellCounts> {
    let mut counts = CellCounts::default();
    if bits.next(1)? == 1 {
        return Some(counts);
    }
    let most = bits.next(u32::BITS).filter(|&most| most < MOST_FRAMES)?;
    let (looked_through, others) = (next_cells(bits)?, next_cells(bits)?);
    counts.set(0, [0; FINDINGS]);
    for_each_bit(looked_through, |index| counts.set(index, [0, most, 0]));
    let (mut code, mut are_right) = (CountsCode::default(), true);
    for_each_bit(others, |index| match code.next(bits) {
        Some(numbers) => counts.set(index, numbers),
        None => are_right = false,
    });
    are_right.then_some(counts)
}

/// Codes the counts of one cell after the other: neighbours are alike.
#[derive(Default)]
struct CountsCode {
    numbers: [NumberCode; FINDINGS],
    last: Counts,
}

impl CountsCode {
    fn put(&mut self, counts: Counts, bits: &mut BitWriter) {
        for ((code, count), last) in self.numbers.iter_mut().zip(counts).zip(self.last) {
            code.put_signed(i64::from(count) - i64::from(last), bits);
        }
        self.last = counts;
    }

    fn next(&mut self, bits: &mut BitReader<'_>) -> Option<Counts> {
        for (code, count) in self.numbers.iter_mut().zip(&mut self.last) {
            let next = i64::from(*count).checked_add(code.next_signed(bits)?)?;
            *count = u32::try_from(next).ok().filter(|&count| count < MOST_FRAMES)?;
        }
        Some(self.last)
    }
}
