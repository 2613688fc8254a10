//! Planes of numbers, packed by their differences from what their neighbours predict.

use crate::entropy_code::{Decoder, Placed, Symbols};
use crate::number_row::{Errors, NumberRow};
use crate::prediction::{CONTEXTS, class_looked_up, context_of, predicted, spread_of};
use dymlm_core::{BitReader, BitWriter};

/// Errors below this are symbols of their own. For a larger error the symbol gives the highest two bits, and
/// the other bits follow uncoded.
const DIRECT: u32 = 16;
const DIRECT_BITS: u32 = DIRECT.ilog2();

/// A plane of numbers, row by row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct NumberPlane {
    /// Numbers in a row.
    pub(crate) width: usize,
    /// All numbers are smaller. At most 2^28.
    pub(crate) count: u32,
    /// Whether a 0 is a hole, where there is no number: a hole predicts nothing, and the number predicted for
    /// its place is used in its stead.
    pub(crate) has_holes: bool,
}

/// Buffers of [`NumberPlane::put`], kept from plane to plane.
#[derive(Debug, Default)]
pub(crate) struct PlaneBuffers {
    /// Of a row.
    numbers: Vec<u32>,
    row: NumberRow,
    /// The row before it.
    above: NumberRow,
    errors: Errors,
    symbols: Symbols,
}

/// What the neighbours before a number predict.
#[derive(Debug, Clone, Copy)]
struct Prediction {
    number: u32,
    context: u8,
}

/// A number that has been visited: its value, or the predicted one if it is a hole.
#[derive(Debug, Clone, Copy, Default)]
struct Visited {
    known: i32,
    is_hole: bool,
}

impl NumberPlane {
    /// Appends numbers.
    pub(crate) fn put(
        self,
        mut numbers: impl ExactSizeIterator<Item = u32>,
        buffers: &mut PlaneBuffers,
        out: &mut Vec<u8>,
    ) {
        let (holes, levels) = self.holes_and_levels();
        let PlaneBuffers { numbers: row_numbers, row, above, errors, symbols } = buffers;
        let mut bits = BitWriter::default();
        let mut is_first = true;
        symbols.begin(CONTEXTS);
        while numbers.len() > 0 {
            row_numbers.clear();
            row_numbers.extend(numbers.by_ref().take(self.width));
            if std::mem::take(&mut is_first) {
                row.fill_first(row_numbers, holes);
                errors.of_first(row, holes, levels);
            } else {
                std::mem::swap(row, above);
                row.fill(row_numbers, holes, above);
                errors.of(row, above, holes, levels);
            }
            symbols.extend(
                errors.iter().map(|(error, context)| Placed { context, symbol: put_error(error, &mut bits) }),
            );
        }
        symbols.put(out);
        bits.finish(out);
    }

    /// Reads `length` numbers that were put; `None` when the bytes hold none.
    pub(crate) fn take(self, length: usize, bytes: &mut &[u8]) -> Option<Vec<u32>> {
        let (holes, levels) = self.holes_and_levels();
        let mut decoder = Decoder::take(bytes, CONTEXTS)?;
        let mut bits = BitReader::take(bytes)?;
        let mut numbers = vec![0; length];
        self.walk(&mut numbers, |prediction| {
            let error = take_error(decoder.next(prediction.context), &mut bits)?;
            if error < holes {
                return Some((error, Visited { known: prediction.number as i32, is_hole: true }));
            }
            let error = error - holes;
            if error >= levels {
                return None;
            }
            let sum = prediction.number + unfolded(error, levels);
            let known = if sum >= levels { sum - levels } else { sum };
            Some((holes + known, Visited { known: known as i32, is_hole: false }))
        })?;
        (decoder.is_done() && bits.is_done()).then_some(numbers)
    }

    /// Smallest number that is no hole, and how many such numbers there are.
    fn holes_and_levels(self) -> (u32, u32) {
        let holes = u32::from(self.has_holes);
        (holes, self.count - holes)
    }

    /// Fills numbers in; `visit` is given what is predicted for one, and returns it and what its neighbours see of it, or
    /// `None` to end.
    #[inline]
    fn walk(
        self,
        numbers: &mut [u32],
        mut visit: impl FnMut(Prediction) -> Option<(u32, Visited)>,
    ) -> Option<()> {
        // One longer than a row: the row's last number is repeated after it.
        let mut above = vec![Visited::default(); self.width + 1];
        let mut is_first = true;
        for row in numbers.chunks_mut(self.width) {
            let [mut second_west, mut west, mut north_west] = [above[0]; 3];
            for (u, number) in row.iter_mut().enumerate() {
                let [north, north_east] = if is_first { [west; 2] } else { [above[u], above[u + 1]] };
                let visited;
                (*number, visited) = visit(Prediction::by(second_west, west, north_west, north, north_east))?;
                (above[u], second_west, west, north_west) = (visited, west, visited, north);
            }
            above[self.width] = west;
            is_first = false;
        }
        Some(())
    }
}

impl Prediction {
    /// The context is made of numbers that are known before that of `west`, and of whether `west` is a hole.
    #[inline]
    fn by(
        second_west: Visited,
        west: Visited,
        north_west: Visited,
        north: Visited,
        north_east: Visited,
    ) -> Self {
        let spread = spread_of(second_west.known, north_west.known, north.known, north_east.known);
        let class = class_looked_up(spread);
        Self {
            number: predicted(west.known, north_west.known, north.known) as u32,
            context: context_of(class, west.is_hole.into(), north.is_hole.into()) as u8,
        }
    }
}

/// Returns the symbol of an error, and writes the bits that the symbol does not give.
#[inline]
fn put_error(error: u32, bits: &mut BitWriter) -> u8 {
    if error < DIRECT {
        return error as u8;
    }
    let low_bits = error.ilog2() - 1;
    bits.put(error & ((1 << low_bits) - 1), low_bits);
    // The highest bit is 1: the symbol gives its place and the next lower bit.
    (DIRECT + 2 * (low_bits + 1 - DIRECT_BITS) + (error >> low_bits & 1)) as u8
}

#[inline]
fn take_error(symbol: u8, bits: &mut BitReader<'_>) -> Option<u32> {
    let symbol = u32::from(symbol);
    if symbol < DIRECT {
        return Some(symbol);
    }
    let index = symbol - DIRECT;
    let low_bits = index / 2 + DIRECT_BITS - 1;
    Some((2 | (index % 2)) << low_bits | bits.next(low_bits)?)
}

/// The error of a number among `count`; the inverse of what packing does.
#[inline]
fn unfolded(folded: u32, count: u32) -> u32 {
    if folded & 1 == 0 { folded / 2 } else { count - folded / 2 - 1 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn bytes_of(plane: NumberPlane, numbers: &[u32]) -> Vec<u8> {
        let mut bytes = Vec::new();
        plane.put(numbers.iter().copied(), &mut PlaneBuffers::default(), &mut bytes);
        bytes
    }

    #[test]
    fn errors_come_back_from_symbol_and_bits() {
        for error in (0..5000).chain([(1 << 20) + 12_345, (1 << 28) - 1]) {
            let mut writer = BitWriter::default();
            let symbol = put_error(error, &mut writer);
            assert!(usize::from(symbol) < crate::entropy_code::SYMBOLS);
            let mut bytes = Vec::new();
            writer.finish(&mut bytes);
            let mut reader = BitReader::take(&mut bytes.as_slice()).unwrap();
            assert_eq!((take_error(symbol, &mut reader), reader.is_done()), (Some(error), true));
        }
    }

    #[test]
    fn a_slope_is_foretold_but_for_its_rim() {
        let slope: Vec<u32> = (0..20_000).map(|i| i % 100 + 3 * (200 - i / 100)).collect();
        let bytes = bytes_of(NumberPlane { width: 100, count: 1000, has_holes: false }, &slope);
        assert!(bytes.len() < 300, "{}", bytes.len());
    }

    #[test]
    fn behind_a_hole_the_surface_before_it_foretells() {
        // A wall with columns of holes.
        let wall = |u: u32| if u % 10 == 4 { 0 } else { 500 };
        let numbers: Vec<u32> = (0..20_000).map(|i| wall(i % 100)).collect();
        let bytes = bytes_of(NumberPlane { width: 100, count: 1000, has_holes: true }, &numbers);
        assert!(bytes.len() < 2000, "{}", bytes.len());
    }

    proptest! {
        #[test]
        fn numbers_come_back(
            (count, numbers) in (2_u32..200_000)
                .prop_flat_map(|count| (Just(count), prop::collection::vec(0..count, 1..200))),
            width in 1_usize..20,
            has_holes: bool,
        ) {
            let plane = NumberPlane { width, count, has_holes };
            let bytes = bytes_of(plane, &numbers);
            let mut rest = bytes.as_slice();
            prop_assert_eq!(plane.take(numbers.len(), &mut rest), Some(numbers));
            prop_assert!(rest.is_empty());
        }

        #[test]
        fn any_bytes_are_refused_or_give_numbers_below_the_count(
            bytes in prop::collection::vec(any::<u8>(), 0..300),
        ) {
            let plane = NumberPlane { width: 7, count: 50, has_holes: true };
            if let Some(numbers) = plane.take(70, &mut bytes.as_slice()) {
                prop_assert!(numbers.iter().all(|&number| number < 50));
            }
        }
    }
}
