//! Planes of numbers as what is left when each is foretold by its neighbours: mostly small numbers.

/// Numbers of a plane, row by row.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Numbers {
    /// Numbers a row.
    pub(crate) width: usize,
    /// All are smaller.
    pub(crate) count: u32,
    /// Whether a 0 says that there is none: then it foretells nothing, and what is foretold there stands for
    /// it.
    pub(crate) has_holes: bool,
}

impl Numbers {
    /// What is left of numbers: numbers below `count` again, small ones for small errors.
    ///
    /// Foretold by the median edge detector of JPEG-LS (Weinberger, Seroussi, Sapiro 2000).
    pub(crate) fn errors_of(self, values: &[u32]) -> Vec<u32> {
        let mut errors = values.to_vec();
        let (holes, levels) = self.holes_and_levels();
        self.foretell(&mut errors, |value, foretold| {
            if *value < holes {
                return foretold;
            }
            let known = *value - holes;
            let error = if known < foretold { known + levels - foretold } else { known - foretold };
            *value = holes + folded(error, levels);
            known
        });
        errors
    }

    /// The numbers again, in place; `None` when the errors are of no numbers below `count`.
    pub(crate) fn undo(self, errors: &mut [u32]) -> Option<()> {
        if errors.iter().any(|&error| error >= self.count) {
            return None;
        }
        let (holes, levels) = self.holes_and_levels();
        self.foretell(errors, |value, foretold| {
            if *value < holes {
                return foretold;
            }
            let sum = foretold + unfolded(*value - holes, levels);
            let known = if sum >= levels { sum - levels } else { sum };
            *value = holes + known;
            known
        });
        Some(())
    }

    /// Smallest number that is one, and how many there are.
    fn holes_and_levels(self) -> (u32, u32) {
        let holes = u32::from(self.has_holes);
        (holes, self.count - holes)
    }

    /// Goes through the numbers; `visit` is given what is foretold, and answers what stands there.
    #[inline]
    fn foretell(self, numbers: &mut [u32], mut visit: impl FnMut(&mut u32, u32) -> u32) {
        let mut above = vec![0; self.width];
        for (v, row) in numbers.chunks_mut(self.width).enumerate() {
            let (mut west, mut north_west) = (above[0], above[0]);
            for (number, above) in row.iter_mut().zip(&mut above) {
                let north = if v == 0 { west } else { *above };
                west = visit(number, foretold(west, north, north_west));
                (*above, north_west) = (west, north);
            }
        }
    }
}

/// The neighbour beyond an edge, else the plane through the three.
#[inline]
fn foretold(west: u32, north: u32, north_west: u32) -> u32 {
    let (low, high) = (west.min(north), west.max(north));
    (west + north).saturating_sub(north_west).clamp(low, high)
}

/// Errors modulo `count` in the order 0, -1, 1, -2, 2 ...
#[inline]
fn folded(error: u32, count: u32) -> u32 {
    let back = count - error;
    if error < back { 2 * error } else { 2 * back - 1 }
}

#[inline]
fn unfolded(folded: u32, count: u32) -> u32 {
    if folded & 1 == 0 { folded / 2 } else { count - folded / 2 - 1 }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    #[test]
    fn small_errors_are_small_numbers() {
        assert_eq!([0, 6, 1, 5, 2, 4, 3].map(|error| folded(error, 7)), [0, 1, 2, 3, 4, 5, 6]);
        assert_eq!([0, 5, 1, 4, 2, 3].map(|error| folded(error, 6)), [0, 1, 2, 3, 4, 5]);
        let slope: Vec<u32> = (0..30).map(|i| i % 10 + 3 * (2 - i / 10)).collect();
        let numbers = Numbers { width: 10, count: 40, has_holes: false };
        assert_eq!(numbers.errors_of(&slope)[11..20], [0; 9]);
    }

    #[test]
    fn behind_a_hole_the_surface_before_it_foretells() {
        let numbers = Numbers { width: 5, count: 40, has_holes: true };
        assert_eq!(numbers.errors_of(&[30, 30, 0, 0, 30])[1..], [1, 0, 0, 1]);
    }

    proptest! {
        #[test]
        fn what_is_foretold_is_undone(
            (count, values) in (2_u32..200_000)
                .prop_flat_map(|count| (Just(count), prop::collection::vec(0..count, 1..200))),
            width in 1_usize..20,
            has_holes: bool,
        ) {
            let numbers = Numbers { width, count, has_holes };
            let mut errors = numbers.errors_of(&values);
            prop_assert!(errors.iter().all(|&error| error < count));
            numbers.undo(&mut errors).unwrap();
            prop_assert_eq!(errors, values);
        }
    }
}
