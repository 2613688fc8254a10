//! Planes of numbers as what is left when each is foretold by its neighbours: mostly small numbers.

/// What is left of numbers below `count`, row by row: numbers below `count` again, small ones for small errors.
///
/// Foretold by the median edge detector of JPEG-LS (Weinberger, Seroussi, Sapiro 2000).
pub(crate) fn errors_of(values: &[u32], width: usize, count: u32) -> Vec<u32> {
    let mut errors = Vec::with_capacity(values.len());
    let mut above: &[u32] = &[];
    for row in values.chunks(width) {
        let (mut west, mut north_west) =
            (above.first().copied().unwrap_or(0), above.first().copied().unwrap_or(0));
        for (u, &value) in row.iter().enumerate() {
            let north = above.get(u).copied().unwrap_or(west);
            let error = value.wrapping_sub(foretold(west, north, north_west));
            errors.push(folded(error.wrapping_add(if (error as i32) < 0 { count } else { 0 }), count));
            (west, north_west) = (value, north);
        }
        above = row;
    }
    errors
}

/// The numbers again, in place; `None` when they are none below `count`.
pub(crate) fn undo(errors: &mut [u32], width: usize, count: u32) -> Option<()> {
    let mut rest = errors;
    let mut above: &[u32] = &[];
    while !rest.is_empty() {
        let (row, below) = rest.split_at_mut(width.min(rest.len()));
        let (mut west, mut north_west) =
            (above.first().copied().unwrap_or(0), above.first().copied().unwrap_or(0));
        for (u, value) in row.iter_mut().enumerate() {
            if *value >= count {
                return None;
            }
            let north = above.get(u).copied().unwrap_or(west);
            let sum = foretold(west, north, north_west) + unfolded(*value, count);
            *value = if sum >= count { sum - count } else { sum };
            (west, north_west) = (*value, north);
        }
        (above, rest) = (row, below);
    }
    Some(())
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
        assert_eq!(errors_of(&slope, 10, 40)[11..20], [0; 9]);
    }

    proptest! {
        #[test]
        fn what_is_foretold_is_undone(
            (count, values) in (1_u32..200_000).prop_flat_map(|count| (Just(count), prop::collection::vec(0..count, 1..200))),
            width in 1_usize..20,
        ) {
            let mut errors = errors_of(&values, width, count);
            prop_assert!(errors.iter().all(|&error| error < count));
            undo(&mut errors, width, count).unwrap();
            prop_assert_eq!(errors, values);
        }
    }
}
