const MAX_DIGIT_BITS: u32 = 11;
const BUCKETS: usize = 1 << MAX_DIGIT_BITS;

/// Sorts entries by the key in their upper 32 bits; keeps its working memory.
#[derive(Debug, Clone, Default)]
pub(super) struct RadixSort {
    spare: Vec<u64>,
    histograms: Vec<[u32; BUCKETS]>,
}

impl RadixSort {
    /// Sorts entries by their keys, at most `max_key`; those of equal keys keep their order.
    ///
    /// Least significant digit first, at most three passes of 11 bits: O(n).
    pub(super) fn sort(&mut self, entries: &mut Vec<u64>, max_key: u32) {
        let bits = 32 - max_key.leading_zeros();
        let passes = bits.div_ceil(MAX_DIGIT_BITS);
        if passes == 0 {
            return;
        }
        let digit_bits = bits.div_ceil(passes);
        let digit =
            |entry: u64, pass: u32| (entry >> (32 + pass * digit_bits)) as usize & ((1 << digit_bits) - 1);

        let Self { spare, histograms } = self;
        histograms.clear();
        histograms.resize(passes as usize, [0; BUCKETS]);
        for &entry in entries.iter() {
            for (pass, histogram) in (0..).zip(histograms.iter_mut()) {
                histogram[digit(entry, pass)] += 1;
            }
        }
        spare.clear();
        spare.resize(entries.len(), 0);
        for (pass, histogram) in (0..).zip(histograms.iter_mut()) {
            let mut next = 0;
            for bucket in histogram.iter_mut() {
                next += std::mem::replace(bucket, next);
            }
            for &entry in entries.iter() {
                let bucket = &mut histogram[digit(entry, pass)];
                spare[*bucket as usize] = entry;
                *bucket += 1;
            }
            std::mem::swap(entries, spare);
        }
    }

    /// The same by keys of up to 64 bits, at most `max_key`: an entry has the lower 32 bits of its key in its upper
    /// half, and in its lower half the place of the whole key in `keys`.
    pub(super) fn sort_by_keys(&mut self, entries: &mut Vec<u64>, keys: &[u64], max_key: u64) {
        self.sort(entries, max_key.min(u64::from(u32::MAX)) as u32);
        if let upper @ 1.. = (max_key >> 32) as u32 {
            for entry in entries.iter_mut() {
                *entry = keys[*entry as u32 as usize] >> 32 << 32 | u64::from(*entry as u32);
            }
            self.sort(entries, upper);
        }
    }
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;

    use super::*;

    #[test]
    fn sorts_stably_at_every_key_width() {
        for bits in 0..=32_u32 {
            let max_key = ((1_u64 << bits) - 1) as u32;
            let mut random = SplitMix64::new(u64::from(bits));
            let mut entries: Vec<u64> = (0..3000)
                .map(|index| (random.below(max_key as usize + 1) as u64) << 32 | (2999 - index))
                .collect();
            let mut expected = entries.clone();
            expected.sort_by_key(|entry| entry >> 32);
            RadixSort::default().sort(&mut entries, max_key);
            assert_eq!(entries, expected, "{bits} bits");
        }
    }

    #[test]
    fn sorts_nothing_and_one() {
        for entries in [vec![], vec![u64::MAX]] {
            let mut sorted = entries.clone();
            RadixSort::default().sort(&mut sorted, u32::MAX);
            assert_eq!(sorted, entries);
        }
    }
}
