use dymlm_core::{BitReader, BitWriter};

use crate::block_store::CellBits;

/// How a row of eight cells begins: many rows are empty or full.
const EMPTY: u32 = 0b0;
const FULL: u32 = 0b01;
const OTHER: u32 = 0b11;

/// Appends a set of cells of a block, by rows of eight cells.
pub(super) fn put_cells(cells: &CellBits, bits: &mut BitWriter) {
    for row in cells.iter().flat_map(|word| word.to_le_bytes()) {
        match row {
            0 => bits.put(EMPTY, 1),
            u8::MAX => bits.put(FULL, 2),
            _ => bits.put(u32::from(row) << 2 | OTHER, 2 + u8::BITS),
        }
    }
}

/// The next set of cells; `None` when there are no more bits.
pub(super) fn next_cells(bits: &mut BitReader<'_>) -> Option<CellBits> {
    let mut cells = CellBits::default();
    for word in &mut cells {
        let mut rows = [0; 8];
        for row in &mut rows {
            if bits.next(1)? == 1 {
                *row = if bits.next(1)? == 1 { bits.next(u8::BITS)? as u8 } else { u8::MAX };
            }
        }
        *word = u64::from_le_bytes(rows);
    }
    Some(cells)
}
