/// Numbers up to this magnitude are rounded correctly.
pub(crate) const ROUNDING_LIMIT: i32 = (1 << 22) - 1;

/// The integer nearest to a number within [`ROUNDING_LIMIT`], ties to even.
///
/// Adding 1.5 * 2^23 leaves the integer in the low bits of the mantissa. Unlike a cast, which saturates and
/// is therefore done number by number, this runs four at a time on any x86-64.
#[inline]
pub(crate) fn round_to_i32(number: f32) -> i32 {
    let shift = (3 << 22) as f32;
    (number + shift).to_bits().wrapping_sub(shift.to_bits()) as i32
}

/// The same for numbers of any size, several times as slow; those beyond the integers become the nearest one.
#[inline]
pub(crate) fn round_far(number: f32) -> i32 {
    number.round_ties_even() as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rounds_like_the_standard_library() {
        let limit = ROUNDING_LIMIT as f32;
        for number in [0.0, 0.4, 0.6, -0.4, -0.6, 1.5, 2.5, -1.5, 1234.4, limit, -limit] {
            assert_eq!(round_to_i32(number), number.round_ties_even() as i32, "{number}");
        }
    }
}
