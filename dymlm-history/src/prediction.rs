//! What the neighbours before a number of a plane predict, without a branch.

/// How many contexts there are: which of two neighbours are holes, times seven classes of how far the neighbours
/// differ.
pub(crate) const CONTEXTS: usize = 4 * CLASSES as usize;
const CLASSES: i32 = 1 + LIMITS.len() as i32;
/// Sums of differences beyond each of these are of a further class.
const LIMITS: [i32; 6] = [0, 1, 2, 4, 8, 16];

/// Predicts a neighbour's number at an edge, else the plane through the three neighbours: the median edge detector
/// of JPEG-LS (Weinberger, Seroussi, Sapiro 2000).
#[inline]
pub(crate) fn predicted(west: i32, north_west: i32, north: i32) -> i32 {
    (west + north - north_west).max(west.min(north)).min(west.max(north))
}

/// How far the neighbours differ. It is made of numbers that are known before the one to the west, so that a decoder
/// need not wait for it.
#[inline]
pub(crate) fn spread_of(second_west: i32, north_west: i32, north: i32, north_east: i32) -> i32 {
    (second_west - north_west).abs() + (north_west - north).abs() + (north - north_east).abs()
}

/// How sure a prediction is: where neighbours differ, errors are larger.
#[inline]
pub(crate) const fn class_of(spread: i32) -> i32 {
    let (mut class, mut limit) = (0, 0);
    while limit < LIMITS.len() {
        class += (spread > LIMITS[limit]) as i32;
        limit += 1;
    }
    class
}

/// The classes of the spreads up to one beyond the last limit.
const CLASS_BY_SPREAD: [u8; LIMITS[LIMITS.len() - 1] as usize + 2] = {
    let mut classes = [0; LIMITS[LIMITS.len() - 1] as usize + 2];
    let mut spread = 0;
    while spread < classes.len() {
        classes[spread] = class_of(spread as i32) as u8;
        spread += 1;
    }
    classes
};

/// [`class_of`] for a decoder, which cannot take several numbers at once.
#[inline]
pub(crate) fn class_looked_up(spread: i32) -> i32 {
    let last = CLASS_BY_SPREAD.len() - 1;
    CLASS_BY_SPREAD[(spread as usize).min(last)].into()
}

/// The context of a class, and of whether the numbers to the west and to the north are holes: 1 if so, else 0.
#[inline]
pub(crate) fn context_of(class: i32, west_hole: i32, north_hole: i32) -> i32 {
    CLASSES * (west_hole + 2 * north_hole) + class
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_class_that_is_looked_up_is_the_class() {
        for spread in (0..40).chain([1000, 3 << 28]) {
            assert_eq!(class_looked_up(spread), class_of(spread), "{spread}");
        }
        assert_eq!([0, 1, 16, 17].map(class_of), [0, 1, 5, 6]);
    }
}
