//! Four real numbers that are computed with at once, for `rustfft`: one transform of these is four
//! transforms.

use std::ops::{Add, Div, Mul, Neg, Rem, Sub};

use rustfft::num_traits::{FromPrimitive, Num, One, Signed, Zero};
use wide::f32x4;

/// Number of lanes.
pub(super) const LANES: usize = 4;

/// Four numbers, each of another plane.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Lanes(pub(super) f32x4);

impl Lanes {
    /// The same number in all lanes.
    pub(super) fn splat(value: f32) -> Self {
        Self(f32x4::splat(value))
    }

    /// The sum of the lanes, in an order that is the same on all processors.
    #[inline]
    pub(super) fn total(self) -> f32 {
        self.0.to_array().iter().sum()
    }

    fn map(self, function: impl Fn(f32) -> f32) -> Self {
        Self(f32x4::new(self.0.to_array().map(function)))
    }
}

/// Implements an operator lane by lane.
macro_rules! lane_by_lane {
    ($($operator:ident $method:ident),*) => {$(
        impl $operator for Lanes {
            type Output = Self;

            #[inline]
            fn $method(self, other: Self) -> Self {
                Self(self.0.$method(other.0))
            }
        }
    )*};
}

lane_by_lane!(Add add, Sub sub, Mul mul, Div div);

impl Rem for Lanes {
    type Output = Self;

    fn rem(self, other: Self) -> Self {
        let (own, other) = (self.0.to_array(), other.0.to_array());
        Self(f32x4::new(std::array::from_fn(|lane| own[lane] % other[lane])))
    }
}

impl Neg for Lanes {
    type Output = Self;

    #[inline]
    fn neg(self) -> Self {
        Self(-self.0)
    }
}

impl Zero for Lanes {
    #[inline]
    fn zero() -> Self {
        Self(f32x4::ZERO)
    }

    fn is_zero(&self) -> bool {
        *self == Self::zero()
    }
}

impl One for Lanes {
    #[inline]
    fn one() -> Self {
        Self::splat(1.0)
    }
}

impl Num for Lanes {
    type FromStrRadixErr = <f32 as Num>::FromStrRadixErr;

    fn from_str_radix(text: &str, radix: u32) -> Result<Self, Self::FromStrRadixErr> {
        f32::from_str_radix(text, radix).map(Self::splat)
    }
}

impl Signed for Lanes {
    fn abs(&self) -> Self {
        self.map(f32::abs)
    }

    fn abs_sub(&self, other: &Self) -> Self {
        (*self - *other).map(|difference| difference.max(0.0))
    }

    fn signum(&self) -> Self {
        self.map(f32::signum)
    }

    fn is_positive(&self) -> bool {
        self.0.to_array().iter().all(|value| *value > 0.0)
    }

    fn is_negative(&self) -> bool {
        self.0.to_array().iter().all(|value| *value < 0.0)
    }
}

impl FromPrimitive for Lanes {
    fn from_i64(number: i64) -> Option<Self> {
        f32::from_i64(number).map(Self::splat)
    }

    fn from_u64(number: u64) -> Option<Self> {
        f32::from_u64(number).map(Self::splat)
    }

    fn from_f64(number: f64) -> Option<Self> {
        f32::from_f64(number).map(Self::splat)
    }
}
