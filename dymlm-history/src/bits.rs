use bytes::{Buf, BufMut};

/// Bits as they are, the first the lowest of a byte.
#[derive(Debug, Default)]
pub(crate) struct BitWriter {
    bytes: Vec<u8>,
    /// Bits that fill no byte yet.
    rest: u64,
    count: u32,
}

impl BitWriter {
    /// Adds the lowest bits of a number, which has no others; at most 32.
    #[inline]
    pub(crate) fn put(&mut self, number: u32, bits: u32) {
        self.rest |= u64::from(number) << self.count;
        self.count += bits;
        while self.count >= 8 {
            self.bytes.push(self.rest as u8);
            self.rest >>= 8;
            self.count -= 8;
        }
    }

    /// Appends the bits, and how many bytes they take.
    pub(crate) fn finish(mut self, out: &mut Vec<u8>) {
        if self.count > 0 {
            self.bytes.push(self.rest as u8);
        }
        out.put_u32_le(self.bytes.len() as u32);
        out.append(&mut self.bytes);
    }
}

/// Bits that were put.
#[derive(Debug)]
pub(crate) struct BitReader<'a> {
    bytes: &'a [u8],
    rest: u64,
    count: u32,
}

impl<'a> BitReader<'a> {
    pub(crate) fn take(bytes: &mut &'a [u8]) -> Option<Self> {
        let length = bytes.try_get_u32_le().ok()? as usize;
        let (own, rest) = bytes.split_at_checked(length)?;
        *bytes = rest;
        Some(Self { bytes: own, rest: 0, count: 0 })
    }

    /// The next bits, at most 32; `None` when there are no more.
    #[inline]
    pub(crate) fn next(&mut self, bits: u32) -> Option<u32> {
        while self.count < bits {
            let (&byte, rest) = self.bytes.split_first()?;
            self.bytes = rest;
            self.rest |= u64::from(byte) << self.count;
            self.count += 8;
        }
        let number = self.rest & ((1 << bits) - 1);
        self.rest >>= bits;
        self.count -= bits;
        Some(number as u32)
    }

    /// Whether no byte is left.
    pub(crate) fn is_done(&self) -> bool {
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
}
