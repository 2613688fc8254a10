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

/// How sure a prediction is: where neighbours differ, errors are larger. The class is made of numbers that are known
/// before the one to the west, so that a decoder need not wait for it.
#[inline]
pub(crate) fn class_of(second_west: i32, north_west: i32, north: i32, north_east: i32) -> i32 {
    let spread = (second_west - north_west).abs() + (north_west - north).abs() + (north - north_east).abs();
    LIMITS.iter().map(|&limit| i32::from(spread > limit)).sum()
}

/// The context of a class, and of whether the numbers to the west and to the north are holes: 1 if so, else 0.
#[inline]
pub(crate) fn context_of(class: i32, west_hole: i32, north_hole: i32) -> i32 {
    CLASSES * (west_hole + 2 * north_hole) + class
}
