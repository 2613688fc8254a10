use dymlm_core::{BitReader, BitWriter};
use serde::{Deserialize, Serialize};

/// Weighted sums of voxels, one after the other, as means and rests; a rest is 0 where a voxel has a single
/// reading.
#[derive(Serialize, Deserialize)]
pub(super) struct SavedSums {
    means: Means,
}

/// The means, as whole numbers.
#[derive(Serialize, Deserialize)]
enum Means {
    /// Each less the one before it, since neighbours are alike.
    Near(Vec<u8>),
    /// Used when a mean does not fit into a byte, since more was taken out than put in.
    Far(Vec<u64>),
}

/// The number by which a sum is divided.
fn divisor(weight: u64) -> u64 {
    weight.max(1)
}

impl SavedSums {
    /// Takes sums with their weights. The rests go to `rests`, each in as many bits as the [divisor] needs,
    /// since all their values are equally likely.
    pub(super) fn of(sums: impl Iterator<Item = (u64, u64)>, rests: &mut BitWriter) -> Self {
        let mut means = Vec::new();
        for (sum, weight) in sums {
            means.push(sum / divisor(weight));
            write_below(rests, sum % divisor(weight), divisor(weight));
        }
        let bytes: Option<Vec<u8>> = means.iter().map(|&mean| u8::try_from(mean).ok()).collect();
        let means = match bytes {
            Some(means) => {
                let before = [0].into_iter().chain(means.iter().copied());
                Means::Near(
                    means.iter().zip(before).map(|(mean, before)| mean.wrapping_sub(before)).collect(),
                )
            }
            None => Means::Far(means),
        };
        Self { means }
    }

    /// The sums of voxels with these weights; `None` when the means or the rests are of other voxels.
    pub(super) fn restored(
        &self,
        weights: impl ExactSizeIterator<Item = u64>,
        rests: &mut BitReader<'_>,
    ) -> Option<Vec<u64>> {
        let means: Vec<u64> = match &self.means {
            Means::Near(steps) => {
                let mut mean = 0_u8;
                let next = |step: &u8| {
                    mean = mean.wrapping_add(*step);
                    mean.into()
                };
                steps.iter().map(next).collect()
            }
            Means::Far(means) => means.clone(),
        };
        if means.len() != weights.len() {
            return None;
        }
        let sum = |(mean, weight): (u64, u64)| {
            let rest = read_below(rests, divisor(weight))?;
            Some(mean.wrapping_mul(divisor(weight)).wrapping_add(rest))
        };
        means.into_iter().zip(weights).map(sum).collect()
    }
}

/// How many bits the smaller ones of the numbers below `end` take, and how many such numbers there are
/// ("truncated binary": the other numbers take one bit more).
fn short_codes(end: u64) -> (u32, u64) {
    let bits = end.ilog2();
    // 2^(bits + 1) - end.
    (bits, (1_u64 << bits).wrapping_mul(2).wrapping_sub(end))
}

/// Writes a number below `end` in the fewest bits.
fn write_below(bits: &mut BitWriter, number: u64, end: u64) {
    let (count, short) = short_codes(end);
    if number < short {
        write(bits, number, count);
    } else {
        // These codes begin with bits that are no short code; the bit that tells two of them apart comes
        // last.
        let code = number.wrapping_add(short);
        write(bits, code >> 1 | (code & 1) << count, count + 1);
    }
}

/// Reads a number below `end`; `None` when there are no more bits.
fn read_below(bits: &mut BitReader<'_>, end: u64) -> Option<u64> {
    let (count, short) = short_codes(end);
    let number = read(bits, count)?;
    if number < short {
        return Some(number);
    }
    Some((number << 1 | read(bits, 1)?).wrapping_sub(short))
}

/// Writes in halves of 32 bits. The number has no bits above the `count` lowest.
#[inline]
fn write(bits: &mut BitWriter, number: u64, count: u32) {
    if count <= 32 {
        bits.put(number as u32, count);
    } else {
        bits.put(number as u32, 32);
        bits.put((number >> 32) as u32, count - 32);
    }
}

fn read(bits: &mut BitReader<'_>, count: u32) -> Option<u64> {
    let low = u64::from(bits.next(count.min(32))?);
    let high = if count > 32 { u64::from(bits.next(count - 32)?) } else { 0 };
    Some(high << 32 | low)
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
    fn sums_come_back_whatever_they_are() {
        let mut sums = vec![(7 * 200, 7), (7 * 3 + 2, 7), (0, 0), (5, 0), (255 * 9 + 8, 9)];
        for _ in 0..2 {
            let (mut rests, mut bytes) = (BitWriter::default(), Vec::new());
            let saved = SavedSums::of(sums.iter().copied(), &mut rests);
            rests.finish(&mut bytes);
            assert_eq!(matches!(saved.means, Means::Near(_)), sums.len() == 5);
            let restored = |weights: &[u64]| {
                let mut reader = BitReader::take(&mut bytes.as_slice()).unwrap();
                saved.restored(weights.iter().copied(), &mut reader)
            };
            let weights: Vec<u64> = sums.iter().map(|(_, weight)| *weight).collect();
            assert!(restored(&weights).unwrap().iter().eq(sums.iter().map(|(sum, _)| sum)));
            assert!(restored(&[1, 2]).is_none());
            sums.push((u64::MAX, 3));
        }
    }
}
