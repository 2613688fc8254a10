//! Codes of whole numbers in few bits: for numbers that are all equally likely, and for numbers that are about
//! as large as those before them.

use dymlm_core::{BitReader, BitWriter};

/// The mean that a [`NumberCode`] begins with. A block has hundreds of numbers, so that it matters little.
const FIRST_MEAN: u64 = 8;
/// The logarithm of how many numbers a mean is taken over. Fewer follow changes faster, more waver less.
const MEMORY_BITS: u32 = 4;
/// Longest quotient that is written as ones: a number that is farther beyond the mean is written as it is.
const MOST_ONES: u32 = 20;
/// Numbers count as no more than this in the mean, so that their sum cannot overflow.
const MOST: u64 = 1 << 40;

/// Codes numbers of which small ones are more likely than large ones: the quotient by a power of two as ones
/// and a zero, then the rest. The power is about the mean of the numbers before (Rice: "Some practical
/// universal noiseless coding techniques", JPL 79-22, 1979).
#[derive(Debug, Clone)]
pub(super) struct NumberCode {
    /// The mean of the numbers before, times 2^[`MEMORY_BITS`]; recent ones count more.
    sum: u64,
}

impl Default for NumberCode {
    fn default() -> Self {
        Self { sum: FIRST_MEAN << MEMORY_BITS }
    }
}

impl NumberCode {
    #[inline]
    pub(super) fn put(&mut self, number: u64, bits: &mut BitWriter) {
        let rest_bits = self.rest_bits();
        let quotient = number >> rest_bits;
        if quotient < MOST_ONES.into() {
            let ones = quotient as u32;
            let rest = number & ((1 << rest_bits) - 1);
            bits.put_long(rest << (ones + 1) | ((1 << ones) - 1), ones + 1 + rest_bits);
        } else {
            put_large(number, bits);
        }
        self.note(number);
    }

    /// The next number; `None` when there are no more bits.
    #[inline]
    pub(super) fn next(&mut self, bits: &mut BitReader<'_>) -> Option<u64> {
        let rest_bits = self.rest_bits();
        let mut quotient = 0_u64;
        while quotient < MOST_ONES.into() && bits.next(1)? == 1 {
            quotient += 1;
        }
        let number = if quotient < MOST_ONES.into() {
            quotient << rest_bits | bits.next_long(rest_bits)?
        } else {
            bits.next_long(u64::BITS)?
        };
        self.note(number);
        Some(number)
    }

    /// As [`put`](Self::put), for a number that may be negative.
    #[inline]
    pub(super) fn put_signed(&mut self, number: i64, bits: &mut BitWriter) {
        // 0, -1, 1, -2, 2 and so on.
        self.put((number << 1 ^ number >> 63) as u64, bits);
    }

    #[inline]
    pub(super) fn next_signed(&mut self, bits: &mut BitReader<'_>) -> Option<i64> {
        let number = self.next(bits)?;
        Some((number >> 1) as i64 ^ -((number & 1) as i64))
    }

    fn rest_bits(&self) -> u32 {
        (self.sum >> MEMORY_BITS | 1).ilog2()
    }

    fn note(&mut self, number: u64) {
        self.sum += number.min(MOST);
        self.sum -= self.sum >> MEMORY_BITS;
    }
}

/// Puts a number that is far beyond the mean. Apart, since it is rare, and the rest is short enough to be put where
/// it is called.
#[cold]
#[inline(never)]
fn put_large(number: u64, bits: &mut BitWriter) {
    bits.put_long((1 << MOST_ONES) - 1, MOST_ONES);
    bits.put_long(number, u64::BITS);
}

/// How many bits the smaller ones of the numbers below `end` take, and how many such numbers there are
/// ("truncated binary": the other numbers take one bit more).
fn short_codes(end: u64) -> (u32, u64) {
    let bits = end.ilog2();
    // 2^(bits + 1) - end.
    (bits, (1_u64 << bits).wrapping_mul(2).wrapping_sub(end))
}

/// Writes a number below `end` in the fewest bits, for numbers that are all equally likely.
#[inline]
pub(super) fn write_below(bits: &mut BitWriter, number: u64, end: u64) {
    let (count, short) = short_codes(end);
    // Without a branch, which nobody could predict: 1 for the numbers that take one bit more. Their codes begin
    // with bits that are no short code; the bit that tells two of them apart comes last.
    let more = u64::from(number >= short);
    let code = number.wrapping_add(short * more);
    bits.put_long(code >> more | (code & more) << count, count + more as u32);
}

/// Reads a number below `end`; `None` when there are no more bits.
pub(super) fn read_below(bits: &mut BitReader<'_>, end: u64) -> Option<u64> {
    let (count, short) = short_codes(end);
    let number = bits.next_long(count)?;
    if number < short {
        return Some(number);
    }
    Some((number << 1 | bits.next_long(1)?).wrapping_sub(short))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_below_any_other_come_back() {
        let ends = [1, 2, 3, 5, 8, 1000, 4096, u64::MAX / 2 + 1, u64::MAX / 2 + 5, u64::MAX];
        let numbers =
            |end: u64| [0, 1, end / 3, end / 2, end.saturating_sub(2), end - 1].map(|n| n.min(end - 1));
        let (mut writer, mut bytes) = (BitWriter::default(), Vec::new());
        for end in ends {
            for number in numbers(end) {
                write_below(&mut writer, number, end);
            }
        }
        writer.finish(&mut bytes);
        let mut reader = BitReader::take(&mut bytes.as_slice()).unwrap();
        for end in ends {
            let back = numbers(end).map(|_| read_below(&mut reader, end).unwrap());
            assert_eq!(back, numbers(end), "below {end}");
        }
    }

    #[test]
    fn any_numbers_come_back_and_small_ones_take_few_bits() {
        let small = (0..4000_i64).map(|n| n * n % 7 - 3);
        let large = [i64::MIN, i64::MAX, 0, -1, 1 << 40, -(1 << 40), 1 << 20, 5];
        let numbers: Vec<i64> = small.chain(large).collect();
        let (mut code, mut writer, mut bytes) = (NumberCode::default(), BitWriter::default(), Vec::new());
        for &number in &numbers {
            code.put_signed(number, &mut writer);
        }
        writer.finish(&mut bytes);
        // Seven equally likely numbers take 2.8 bits; large ones take up to 84 bits.
        assert!(bytes.len() * 8 < 4000 * 7 / 2 + large.len() * 84, "{} bytes", bytes.len());
        let (mut code, mut reader) = (NumberCode::default(), BitReader::take(&mut bytes.as_slice()).unwrap());
        for &number in &numbers {
            assert_eq!(code.next_signed(&mut reader), Some(number));
        }
        assert!(reader.is_done());
    }
}
