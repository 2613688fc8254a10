//! A row of a [`NumberPlane`](crate::number_plane::NumberPlane) that is packed, all at once: where every number is
//! known, nothing waits for the one before, and a processor takes several together. Numbers are below 2^28, so that
//! sums of a few of them have a sign to spare.

use crate::prediction::{class_of, context_of, predicted, spread_of};

/// Places before a row's first number, for its neighbours to the west.
const BEFORE: usize = 2;

/// The numbers of a row, from the smallest that is no hole, with neighbours for its first and last number.
#[derive(Debug, Default)]
pub(crate) struct NumberRow {
    /// A hole has the number that was predicted for it.
    known: Vec<i32>,
    /// 1 at a hole, 0 elsewhere.
    holes: Vec<i32>,
}

/// What a row's numbers differ from their predictions by, as small numbers, and the contexts of the predictions.
#[derive(Debug, Default)]
pub(crate) struct Errors {
    errors: Vec<i32>,
    contexts: Vec<i32>,
}

impl NumberRow {
    /// The first row of a plane: north of a number is the one to its west. Numbers below `holes` are holes.
    pub(crate) fn fill_first(&mut self, numbers: &[u32], holes: u32) {
        self.take(numbers, holes, [0, 0]);
        for u in 0..numbers.len() {
            if self.holes[u + BEFORE] == 1 {
                self.known[u + BEFORE] = predicted(self.known[u + 1], self.known[u], self.known[u + 1]);
            }
        }
        self.end();
    }

    /// Any other row, with the one above it.
    pub(crate) fn fill(&mut self, numbers: &[u32], holes: u32, above: &mut Self) {
        let first = [above.known[BEFORE], above.holes[BEFORE]];
        // North-west of the first number is the number to its north.
        (above.known[1], above.holes[1]) = (first[0], first[1]);
        self.take(numbers, holes, first);
        if holes > 0 {
            for u in 0..numbers.len() {
                if self.holes[u + BEFORE] == 1 {
                    let [north_west, north] = [above.known[u + 1], above.known[u + BEFORE]];
                    self.known[u + BEFORE] = predicted(self.known[u + 1], north_west, north);
                }
            }
        }
        self.end();
    }

    /// Takes numbers, those of holes still to be predicted, after a number and a hole to their west.
    fn take(&mut self, numbers: &[u32], holes: u32, [known, hole]: [i32; 2]) {
        self.known.clear();
        self.known.extend([known; BEFORE]);
        self.known.extend(numbers.iter().map(|number| number.wrapping_sub(holes) as i32));
        self.holes.clear();
        self.holes.extend([hole; BEFORE]);
        self.holes.extend(numbers.iter().map(|&number| i32::from(number < holes)));
    }

    /// The last number is repeated after the row.
    fn end(&mut self) {
        self.known.extend(self.known.last().copied());
    }
}

impl Errors {
    /// Of the first row of a plane with so many numbers that are no holes.
    pub(crate) fn of_first(&mut self, row: &NumberRow, holes: u32, levels: u32) {
        let NumberRow { known, holes: are_holes } = row;
        self.errors.clear();
        self.contexts.clear();
        for (known, are_holes) in known.windows(BEFORE + 1).zip(are_holes.windows(BEFORE + 1)) {
            let (&[second_west, west, number], &[_, west_hole, hole]) = (known, are_holes) else { continue };
            let error = folded(number - predicted(west, second_west, west), levels as i32) + holes as i32;
            self.errors.push(error & (hole - 1));
            let class = class_of(spread_of(second_west, second_west, west, west));
            self.contexts.push(context_of(class, west_hole, west_hole));
        }
    }

    /// Of any other row.
    pub(crate) fn of(&mut self, row: &NumberRow, above: &NumberRow, holes: u32, levels: u32) {
        let length = row.holes.len() - BEFORE;
        self.errors.resize(length, 0);
        self.contexts.resize(length, 0);
        put_errors(row, above, &mut self.errors, holes as i32, levels as i32);
        put_contexts(row, above, &mut self.contexts);
    }

    /// Errors and contexts.
    pub(crate) fn iter(&self) -> impl Iterator<Item = (u32, u8)> {
        self.errors.iter().zip(&self.contexts).map(|(&error, &context)| (error as u32, context as u8))
    }
}

/// One loop over slices of one length without a branch, so that the compiler takes several numbers at once.
#[inline(never)]
fn put_errors(row: &NumberRow, above: &NumberRow, errors: &mut [i32], holes: i32, levels: i32) {
    let length = errors.len();
    let [west, number] = [1, 2].map(|first| &row.known[first..][..length]);
    let [north_west, north] = [1, 2].map(|first| &above.known[first..][..length]);
    let is_hole = &row.holes[BEFORE..][..length];
    for u in 0..length {
        let difference = number[u] - predicted(west[u], north_west[u], north[u]);
        errors[u] = (folded(difference, levels) + holes) & (is_hole[u] - 1);
    }
}

#[inline(never)]
fn put_contexts(row: &NumberRow, above: &NumberRow, contexts: &mut [i32]) {
    let length = contexts.len();
    let second_west = &row.known[..length];
    let [north_west, north, north_east] = [1, 2, 3].map(|first| &above.known[first..][..length]);
    let (west_hole, north_hole) = (&row.holes[1..][..length], &above.holes[BEFORE..][..length]);
    for u in 0..length {
        let class = class_of(spread_of(second_west[u], north_west[u], north[u], north_east[u]));
        contexts[u] = context_of(class, west_hole[u], north_hole[u]);
    }
}

/// Numbers the errors modulo `count`, which is more than their size, in the order 0, -1, 1, -2, 2 ...
#[inline]
fn folded(error: i32, count: i32) -> i32 {
    let error = error + (count & error >> 31);
    (2 * error).min(2 * (count - error) - 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_errors_are_small_numbers() {
        assert_eq!([0, 6, 1, 5, 2, 4, 3].map(|error| folded(error, 7)), [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!([0, -1, 1, -2, 2, -3, 3].map(|error| folded(error, 7)), [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!([0, 5, 1, 4, 2, 3].map(|error| folded(error, 6)), [0, 1, 2, 3, 4, 5]);
    }
}
