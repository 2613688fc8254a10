/// Up to this number of neighbours it is faster to compare points one by one; beyond, to compare boxes of
/// them.
const MOST_ONE_BY_ONE: u32 = 512;

/// Whether so many neighbours are asked for that points are not to be compared one by one: that would take
/// O(`min_points` n).
pub(super) fn has_large_counts(min_points: u32) -> bool {
    min_points > MOST_ONE_BY_ONE
}
