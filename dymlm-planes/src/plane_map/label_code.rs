//! Compression of label images, for the patches that a key frame has seen.
//!
//! Each site is predicted from its neighbours: it has the label to its left, or else the label above. How
//! likely that is depends on how the neighbours agree. An adaptive binary arithmetic coder (Witten, Neal,
//! Cleary 1987; contexts like those of JBIG) codes whether the prediction is right. The insides of patches
//! cost next to nothing, rims some bits per site: a third of what run lengths take.

/// Bits of a label that was not predicted.
const LABEL_BITS: u32 = 10;
/// Largest label.
pub(super) const MOST_LABELS: usize = (1 << LABEL_BITS) - 1;
/// Number of contexts: six yes-or-no answers on how neighbours agree.
const CONTEXTS: usize = 64;
/// Width of the rim of empty sites around an image, so that each site has neighbours.
const RIM: usize = 2;
/// Number of sites that are coded at once where all neighbours have one label, as most have.
const SPAN: usize = 16;
/// Bits of a probability, and its rate of adaptation: by 1/16 of the way with each coded bit.
const PROBABILITY_BITS: u32 = 16;
const RATE: u32 = 4;

/// Writes or reads a bit with the given probability of being set.
trait BitCoder {
    fn code(&mut self, bit: bool, probability: u16) -> bool;
}

/// The interval of all numbers that begin with what was coded so far.
#[derive(Debug, Clone, Copy)]
struct Interval {
    low: u32,
    high: u32,
}

impl Interval {
    const ALL: Self = Self { low: 0, high: u32::MAX };

    /// The last number of the part of the interval that stands for a set bit.
    fn split(self, probability: u16) -> u32 {
        let width = u64::from(self.high - self.low);
        self.low + ((width * u64::from(probability)) >> PROBABILITY_BITS) as u32
    }

    fn narrow(&mut self, bit: bool, split: u32) {
        if bit {
            self.high = split;
        } else {
            self.low = split + 1;
        }
    }

    /// Shifts out the first byte if it is the same for all numbers of the interval.
    fn shift(&mut self) -> Option<u8> {
        let is_known = (self.low ^ self.high) >> 24 == 0;
        is_known.then(|| {
            let byte = (self.low >> 24) as u8;
            (self.low, self.high) = (self.low << 8, self.high << 8 | 0xff);
            byte
        })
    }
}

struct Writer {
    interval: Interval,
    bytes: Vec<u8>,
}

impl BitCoder for Writer {
    fn code(&mut self, bit: bool, probability: u16) -> bool {
        self.interval.narrow(bit, self.interval.split(probability));
        while let Some(byte) = self.interval.shift() {
            self.bytes.push(byte);
        }
        bit
    }
}

struct Reader<'a> {
    interval: Interval,
    number: u32,
    bytes: std::slice::Iter<'a, u8>,
}

impl Reader<'_> {
    fn next_byte(&mut self) {
        self.number = self.number << 8 | u32::from(self.bytes.next().copied().unwrap_or(0));
    }
}

impl BitCoder for Reader<'_> {
    fn code(&mut self, _: bool, probability: u16) -> bool {
        let split = self.interval.split(probability);
        let bit = self.number <= split;
        self.interval.narrow(bit, split);
        while self.interval.shift().is_some() {
            self.next_byte();
        }
        bit
    }
}

/// The code of an image of labels, row by row. O(sites).
pub(super) fn encode(labels: &[u16], columns: usize) -> Box<[u8]> {
    let mut writer = Writer { interval: Interval::ALL, bytes: Vec::new() };
    code_labels(&mut writer, &mut with_rim(labels, columns), columns);
    // The shortest number in the interval; missing bytes are read as zeros.
    let Interval { low, high } = writer.interval;
    if low > 0 {
        let bytes = (1..4).find(|&bytes| {
            let unit = 1_u32 << (32 - 8 * bytes);
            low.checked_add(unit - 1).is_some_and(|up| up & !(unit - 1) <= high)
        });
        let bytes = bytes.unwrap_or(4);
        let unit = if bytes == 4 { 1 } else { 1_u32 << (32 - 8 * bytes) };
        let number = low.saturating_add(unit - 1) & !(unit - 1);
        writer.bytes.extend(&number.to_be_bytes()[..bytes as usize]);
    }
    writer.bytes.into_boxed_slice()
}

/// The labels that a code stands for. O(sites).
pub(super) fn decode(code: &[u8], sites: usize, columns: usize) -> Vec<u16> {
    let mut reader = Reader { interval: Interval::ALL, number: 0, bytes: code.iter() };
    (0..4).for_each(|_| reader.next_byte());
    let mut labels = with_rim(&vec![0; sites], columns);
    code_labels(&mut reader, &mut labels, columns);
    let rows = labels.chunks_exact(columns.max(1) + 2 * RIM).skip(RIM);
    rows.flat_map(|row| &row[RIM..RIM + columns.max(1)]).copied().take(sites).collect()
}

/// The labels with a rim of empty sites; missing sites of the last row are empty too.
fn with_rim(labels: &[u16], columns: usize) -> Vec<u16> {
    let (columns, width) = (columns.max(1), columns.max(1) + 2 * RIM);
    let mut wide = vec![0; (labels.len().div_ceil(columns) + RIM) * width];
    for (row, wide) in labels.chunks(columns).zip(wide.chunks_exact_mut(width).skip(RIM)) {
        wide[RIM..RIM + row.len()].copy_from_slice(row);
    }
    wide
}

/// Codes labels one by one: a writer takes them from `labels`, a reader fills them in.
fn code_labels(coder: &mut impl BitCoder, labels: &mut [u16], columns: usize) {
    let even = 1_u16 << (PROBABILITY_BITS - 1);
    let mut is_left = [even; CONTEXTS];
    let mut is_above = [even; CONTEXTS];
    let mut is_span = even;
    let mut is_set = vec![even; 1 << LABEL_BITS];
    let mut code = |bit: bool, probability: &mut u16| {
        let bit = coder.code(bit, *probability);
        // The probability stays away from 0 and 1, so that either bit can be coded.
        let aim = if bit { u16::MAX - (1 << RATE) } else { 1 << RATE };
        let change = (i32::from(aim) - i32::from(*probability)) >> RATE;
        *probability = (i32::from(*probability) + change) as u16;
        bit
    };
    let (columns, width) = (columns.max(1), columns.max(1) + 2 * RIM);
    let (end, mut site, mut single) = (labels.len() - RIM, RIM * width + RIM, 0);
    while site < end {
        let column = site % width - RIM;
        if column >= columns {
            site += 2 * RIM;
            continue;
        }
        let left = labels[site - 1];
        let is_even = |labels: &[u16]| labels.iter().all(|&label| label == left);
        let span = site..site + SPAN;
        if single == 0 && column + SPAN <= columns && is_even(&labels[site - width - 1..=site - width + SPAN])
        {
            if code(is_even(&labels[span.clone()]), &mut is_span) {
                labels[span].fill(left);
                site += SPAN;
                continue;
            }
            single = SPAN;
        }
        single = single.saturating_sub(1);
        let second_left = labels[site - 2];
        let over = &labels[site - width - 1..=site - width + 1];
        let (above_left, above, above_right) = (over[0], over[1], over[2]);
        let second_above = labels[site - 2 * width];
        let context = [
            left == above,
            left == above_left,
            above == above_right,
            left == second_left,
            above == second_above,
            left == 0,
        ];
        let context = context.iter().fold(0, |context, &bit| context << 1 | usize::from(bit));
        let own = labels[site];
        labels[site] = if code(own == left, &mut is_left[context]) {
            left
        } else if left != above && code(own == above, &mut is_above[context]) {
            above
        } else {
            let bits = (0..LABEL_BITS).rev().fold(1_usize, |bits, k| {
                let place = bits & (is_set.len() - 1);
                bits << 1 | usize::from(code(own >> k & 1 == 1, &mut is_set[place]))
            });
            bits as u16 & MOST_LABELS as u16
        };
        site += 1;
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    proptest! {
        #[test]
        fn what_was_written_is_read(
            labels in prop::collection::vec(prop_oneof![4 => 0..3_u16, 1 => 0..=MOST_LABELS as u16], 0..400),
            columns in 1..30_usize,
        ) {
            let code = encode(&labels, columns);
            prop_assert_eq!(decode(&code, labels.len(), columns), labels);
        }
    }

    #[test]
    fn patches_cost_their_rims() {
        // Two squares of 40 sites in an image of 160 x 120, one with a rim that jitters.
        let label = |site: usize| {
            let (u, v) = (site % 160, site / 160);
            let jitter = (v * v * 7919) % 3;
            match () {
                () if (20 + jitter..60).contains(&u) && (30..70).contains(&v) => 1,
                () if (80..120).contains(&u) && (30..70).contains(&v) => 2,
                () => 0,
            }
        };
        let labels: Vec<u16> = (0..160 * 120).map(label).collect();
        let code = encode(&labels, 160);
        assert_eq!(decode(&code, labels.len(), 160), labels);
        assert!(code.len() < 100, "{}", code.len());
    }
}
