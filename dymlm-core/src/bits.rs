/// Writes bits uncoded; the first bit is the lowest of a byte.
///
/// ```
/// use dymlm_core::{BitReader, BitWriter};
///
/// let (mut writer, mut bytes) = (BitWriter::default(), Vec::new());
/// writer.put(5, 3);
/// writer.put(1000, 10);
/// writer.finish(&mut bytes);
/// let mut reader = BitReader::take(&mut bytes.as_slice()).ok_or("cut short")?;
/// assert_eq!((reader.next(3), reader.next(10)), (Some(5), Some(1000)));
/// # Ok::<(), &str>(())
/// ```
#[derive(Debug, Default)]
pub struct BitWriter {
    bytes: Vec<u8>,
    /// Bits that fill no word yet.
    rest: u64,
    count: u32,
}

impl BitWriter {
    /// A writer with room for so many bytes.
    pub fn with_capacity(bytes: usize) -> Self {
        Self { bytes: Vec::with_capacity(bytes), ..Self::default() }
    }

    /// Adds the lowest `bits` bits of a number, at most 32; its other bits must be 0.
    #[inline]
    pub fn put(&mut self, number: u32, bits: u32) {
        self.put_long(number.into(), bits);
    }

    /// As [`put`](Self::put), for at most 64 bits.
    #[inline]
    pub fn put_long(&mut self, number: u64, bits: u32) {
        self.rest |= number << self.count;
        self.count += bits;
        if self.count >= u64::BITS {
            self.bytes.extend_from_slice(&self.rest.to_le_bytes());
            self.count -= u64::BITS;
            // The bits that did not fit into the word.
            self.rest = number.checked_shr(bits - self.count).unwrap_or(0);
        }
    }

    /// The bits as words, the first one lowest; 0 where none fill the last word up.
    pub fn into_words(self) -> Vec<u64> {
        let (words, _) = self.bytes.as_chunks();
        let rest = (self.count > 0).then_some(self.rest);
        words.iter().map(|&word| u64::from_le_bytes(word)).chain(rest).collect()
    }

    /// Appends the number of bytes that the bits take, then the bits.
    pub fn finish(self, out: &mut Vec<u8>) {
        let rest = self.rest.to_le_bytes();
        let rest = &rest[..self.count.div_ceil(u8::BITS) as usize];
        let len = self.bytes.len() + rest.len();
        out.reserve(size_of::<u32>() + len);
        out.extend((len as u32).to_le_bytes());
        out.extend_from_slice(&self.bytes);
        out.extend_from_slice(rest);
    }
}

/// Reads bits that were put by a [`BitWriter`].
#[derive(Debug)]
pub struct BitReader<'a> {
    bytes: &'a [u8],
    rest: u64,
    count: u32,
}

impl<'a> BitReader<'a> {
    /// Takes the bits at the beginning of `bytes`, which then begins after them; `None` when they are cut
    /// short.
    pub fn take(bytes: &mut &'a [u8]) -> Option<Self> {
        let (length, rest) = bytes.split_first_chunk()?;
        let (own, rest) = rest.split_at_checked(u32::from_le_bytes(*length) as usize)?;
        *bytes = rest;
        Some(Self { bytes: own, rest: 0, count: 0 })
    }

    /// The next bits, at most 32; `None` when there are no more.
    #[inline]
    pub fn next(&mut self, bits: u32) -> Option<u32> {
        if self.count < bits {
            self.refill(bits)?;
        }
        let number = self.rest & ((1 << bits) - 1);
        self.rest >>= bits;
        self.count -= bits;
        Some(number as u32)
    }

    /// As [`next`](Self::next), for at most 64 bits.
    #[inline]
    pub fn next_long(&mut self, bits: u32) -> Option<u64> {
        let low = u64::from(self.next(bits.min(32))?);
        let high = if bits > 32 { u64::from(self.next(bits - 32)?) } else { 0 };
        Some(high << 32 | low)
    }

    /// Takes a word, or the last bytes one by one, so that there are at least `bits` bits.
    fn refill(&mut self, bits: u32) -> Option<()> {
        if let Some((word, rest)) = self.bytes.split_first_chunk() {
            self.bytes = rest;
            self.rest |= u64::from(u32::from_le_bytes(*word)) << self.count;
            self.count += 32;
            return Some(());
        }
        while self.count < bits {
            let (&byte, rest) = self.bytes.split_first()?;
            self.bytes = rest;
            self.rest |= u64::from(byte) << self.count;
            self.count += 8;
        }
        Some(())
    }

    /// Whether nothing is left but bits that are 0.
    pub fn is_done(&self) -> bool {
        self.bytes.is_empty() && self.rest == 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bits_come_back() {
        let numbers: Vec<(u32, u32)> =
            (0..=32).map(|bits| (((1_u64 << bits) - 1) as u32 / 3, bits)).collect();
        let mut writer = BitWriter::default();
        for &(number, bits) in &numbers {
            writer.put(number, bits);
        }
        let mut bytes = Vec::new();
        writer.finish(&mut bytes);
        assert_eq!(bytes.len(), 4 + (32_usize * 33 / 2).div_ceil(8));
        let mut rest = bytes.as_slice();
        let mut reader = BitReader::take(&mut rest).unwrap();
        assert!(numbers.iter().all(|&(number, bits)| reader.next(bits) == Some(number)));
        assert!(rest.is_empty() && reader.is_done());
        assert_eq!(reader.next(32), None);
    }

    #[test]
    fn words_begin_with_the_lowest_bits_and_end_with_zeros() {
        let words = |numbers: &[(u64, u32)]| {
            let mut writer = BitWriter::default();
            for &(number, bits) in numbers {
                writer.put_long(number, bits);
            }
            writer.into_words()
        };
        assert_eq!(words(&[]), [0; 0]);
        assert_eq!(words(&[(5, 3), (1, 1)]), [0b1101]);
        assert_eq!(words(&[(7, 60), (0xAB, 8)]), [0xB << 60 | 7, 0xA]);
        assert_eq!(words(&[(1, 64), (0, 0)]), [1]);
    }

    #[test]
    fn long_numbers_come_back_after_any_number_of_bits() {
        let numbers =
            |before: u32| [(1, before.min(1)), (u64::MAX, 64), (u64::MAX >> 7, 57), (0, 0), (5, before)];
        let (mut writer, mut bytes) = (BitWriter::default(), Vec::new());
        (3..64).flat_map(numbers).for_each(|(number, bits)| writer.put_long(number, bits));
        writer.finish(&mut bytes);
        let mut reader = BitReader::take(&mut bytes.as_slice()).unwrap();
        assert!((3..64).flat_map(numbers).all(|(number, bits)| reader.next_long(bits) == Some(number)));
        assert!(reader.is_done());
    }
}
