/// Up to this number of neighbours it is faster to compare points one by one; beyond, to compare boxes of
/// them.
const MOST_ONE_BY_ONE: u32 = 512;

/// Whether `min_points` is too large for comparing points one by one, which would take O(`min_points` n).
pub(super) fn has_large_counts(min_points: u32) -> bool {
    min_points > MOST_ONE_BY_ONE
}
