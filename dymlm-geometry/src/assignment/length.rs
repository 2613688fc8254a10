use std::fmt::Debug;
use std::ops::{AddAssign, SubAssign};

/// Lengths of paths, which are whole numbers: as `f64`, which vector registers compare and add two at a time,
/// or as `i64`, which holds greater ones.
pub(super) trait Length: Copy + Default + Debug + PartialOrd + AddAssign + SubAssign {
    /// Longer than any path.
    const ENDLESS: Self;
    /// The potential of a column that no path may lead to any more.
    const CLOSED: Self;

    /// The cost of a pair of this weight.
    fn cost(weight: i64) -> Self;

    /// `length` + `cost` - `potential`; endless where the potential is closed or the cost endless.
    fn through(length: Self, cost: Self, potential: Self) -> Self;

    /// `length` - `potential`.
    fn without(length: Self, potential: Self) -> Self;

    /// Whether all lengths are exact for this number of pairs, each of at most this weight.
    fn holds(pairs: usize, greatest_weight: i64) -> bool;
}

impl Length for f64 {
    const ENDLESS: Self = Self::INFINITY;
    const CLOSED: Self = Self::NEG_INFINITY;

    #[inline]
    fn cost(weight: i64) -> Self {
        -(weight as Self)
    }

    #[inline]
    fn through(length: Self, cost: Self, potential: Self) -> Self {
        length + (cost - potential)
    }

    #[inline]
    fn without(length: Self, potential: Self) -> Self {
        length - potential
    }

    /// A path has at most one pair of each row, and potentials are differences of lengths of paths.
    fn holds(pairs: usize, greatest_weight: i64) -> bool {
        (8 * pairs as u64).saturating_mul(greatest_weight as u64) < 1 << Self::MANTISSA_DIGITS
    }
}

impl Length for i64 {
    const ENDLESS: Self = Self::MAX;
    const CLOSED: Self = Self::MIN;

    #[inline]
    fn cost(weight: i64) -> Self {
        -weight
    }

    #[inline]
    fn through(length: Self, cost: Self, potential: Self) -> Self {
        let is_open = potential != Self::CLOSED && cost != Self::ENDLESS;
        if is_open { length + (cost - potential) } else { Self::ENDLESS }
    }

    #[inline]
    fn without(length: Self, potential: Self) -> Self {
        length - potential
    }

    fn holds(_: usize, _: i64) -> bool {
        true
    }
}
