use crate::mask::{WORD, ones};
use crate::pinhole_camera::check_image_size;
use crate::{Error, Mask};

/// A mask as COCO's run-lengths (`pycocotools.mask`): lengths of runs of equal pixels, down the columns from
/// left to right, the first run `false`. Of an object's mask they take about a hundredth of its memory.
///
/// With the feature `serde` it is COCO's object, as a [`Mask`] is.
///
/// ```
/// use dymlm_core::{Mask, RunLengths};
///
/// let packed = RunLengths::new(3, 2, vec![2, 3, 1])?;
/// assert_eq!(packed.mask(), Mask::from_run_lengths(3, 2, &[2, 3, 1])?);
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunLengths {
    width: usize,
    height: usize,
    runs: Box<[u32]>,
}

impl RunLengths {
    /// Takes the runs of an image of `width` x `height` pixels.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`]; [`Error::RunLengths`] when they do not add up to the image.
    pub fn new(width: usize, height: usize, runs: Vec<u32>) -> Result<Self, Error> {
        check(width, height, &runs)?;
        Ok(Self { width, height, runs: runs.into() })
    }

    /// The mask. O(pixels / 64 + runs + columns).
    pub fn mask(&self) -> Mask {
        decoded(self.width, self.height, &self.runs)
    }

    /// Bytes of memory that the mask takes.
    pub fn mask_bytes(&self) -> u64 {
        8 * self.height as u64 * self.width.div_ceil(WORD) as u64
    }
}

/// The mask as run-lengths and back.
impl Mask {
    /// The mask as COCO's run-lengths. O(pixels).
    ///
    /// ```
    /// use dymlm_core::Mask;
    ///
    /// let mask = Mask::from_fn(3, 2, |u, v| u == 1 || (u, v) == (2, 0))?;
    /// assert_eq!(mask.run_lengths(), [2, 3, 1]);
    /// assert_eq!(Mask::from_run_lengths(3, 2, &[2, 3, 1])?, mask);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    #[doc(alias = "RLE")]
    pub fn run_lengths(&self) -> Vec<u32> {
        let mut runs = vec![0];
        let mut is_true = false;
        for (u, v) in (0..self.width()).flat_map(|u| (0..self.height()).map(move |v| (u, v))) {
            if self.at(u, v) != is_true {
                is_true = !is_true;
                runs.push(0);
            }
            runs.last_mut().into_iter().for_each(|run| *run += 1);
        }
        runs
    }

    /// The mask that COCO's run-lengths give. O(pixels / 64 + runs + columns).
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`]; [`Error::RunLengths`] when they do not add up to the image.
    #[doc(alias = "RLE")]
    pub fn from_run_lengths(width: usize, height: usize, runs: &[u32]) -> Result<Self, Error> {
        check(width, height, runs)?;
        Ok(decoded(width, height, runs))
    }
}

fn check(width: usize, height: usize, runs: &[u32]) -> Result<(), Error> {
    let pixels = check_image_size(width, height)?;
    let sum = runs.iter().map(|&run| u64::from(run)).sum();
    if sum == pixels as u64 { Ok(()) } else { Err(Error::RunLengths { width, height, sum }) }
}

/// Runs go down the columns, and a mask's words along its rows: 64 columns at a time are filled by words that
/// go down, and then turned in squares of 64 pixels.
fn decoded(width: usize, height: usize, runs: &[u32]) -> Mask {
    let mut mask = Mask::unset(width, height);
    // Square by square from the top, a word for each column.
    let mut strip = vec![0; height.div_ceil(WORD) * WORD];
    let (mut strip_index, mut start) = (0, 0);
    for (index, &run) in runs.iter().enumerate() {
        let end = start + run as usize;
        while index % 2 == 1 && start < end {
            let (u, v) = (start / height, start % height);
            if u / WORD != strip_index {
                turn(&mut strip, &mut mask, strip_index);
                strip_index = u / WORD;
            }
            let bottom = height.min(v + end - start);
            for square in v / WORD..bottom.div_ceil(WORD) {
                let first = v.saturating_sub(square * WORD);
                strip[square * WORD + u % WORD] |= ones(first..(bottom - square * WORD).min(WORD));
            }
            start += bottom - v;
        }
        start = end;
    }
    turn(&mut strip, &mut mask, strip_index);
    mask
}

/// Writes 64 columns, which go down, into the words of a mask, and clears them.
fn turn(strip: &mut [u64], mask: &mut Mask, word: usize) {
    for (square, columns) in strip.as_chunks_mut().0.iter_mut().enumerate() {
        if *columns != [0; WORD] {
            transpose(columns);
            for (row, &bits) in columns.iter().enumerate() {
                mask.set_word(square * WORD + row, word, bits);
            }
            *columns = [0; WORD];
        }
    }
}

/// Bit r of word c becomes bit c of word r: the halves that are on the wrong side of the diagonal change
/// places, then the quarters within each half, and so on.
fn transpose(square: &mut [u64; WORD]) {
    let (mut side, mut low) = (WORD / 2, u64::MAX >> (WORD / 2));
    while side > 0 {
        for upper in (0..WORD).filter(|row| row & side == 0) {
            let differs = (square[upper] >> side ^ square[upper + side]) & low;
            square[upper] ^= differs << side;
            square[upper + side] ^= differs;
        }
        side /= 2;
        low ^= low << side;
    }
}

/// COCO's object `{"size": [height, width], "counts": ...}`; counts are written as COCO's compressed text,
/// and read as that or as a list of numbers.
#[cfg(feature = "serde")]
mod coco {
    use std::borrow::Cow;

    use serde::de::Error as _;
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    use crate::{Mask, RunLengths};

    #[derive(Serialize, Deserialize)]
    struct CocoMask<'a> {
        size: [usize; 2],
        #[serde(borrow)]
        counts: Counts<'a>,
    }

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    enum Counts<'a> {
        List(Vec<u32>),
        #[serde(borrow)]
        Text(Cow<'a, str>),
    }

    impl Serialize for Mask {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            let counts = Counts::Text(compressed(&self.run_lengths()).into());
            CocoMask { size: [self.height(), self.width()], counts }.serialize(serializer)
        }
    }

    impl Serialize for RunLengths {
        fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
            let counts = Counts::Text(compressed(&self.runs).into());
            CocoMask { size: [self.height, self.width], counts }.serialize(serializer)
        }
    }

    impl<'de> Deserialize<'de> for RunLengths {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            let CocoMask { size: [height, width], counts } = CocoMask::deserialize(deserializer)?;
            let runs = match counts {
                Counts::List(runs) => runs,
                Counts::Text(text) => decompressed(&text)
                    .ok_or_else(|| D::Error::custom("counts are no run-lengths of COCO"))?,
            };
            Self::new(width, height, runs).map_err(D::Error::custom)
        }
    }

    impl<'de> Deserialize<'de> for Mask {
        fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
            Ok(RunLengths::deserialize(deserializer)?.mask())
        }
    }

    /// `rleToString` of the COCO API: from the fourth run on the difference to the run two before it, in
    /// groups of five bits from the lowest, each group a character from 48 on with bit 5 set when another
    /// follows.
    fn compressed(runs: &[u32]) -> String {
        let mut text = String::new();
        for (index, &run) in runs.iter().enumerate() {
            let before =
                index.checked_sub(2).filter(|&before| before > 0).and_then(|before| runs.get(before));
            let mut rest = i64::from(run) - before.map_or(0, |&before| i64::from(before));
            loop {
                let group = (rest & 0x1f) as u8;
                rest >>= 5;
                let is_last = if group & 0x10 == 0 { rest == 0 } else { rest == -1 };
                text.push(char::from(48 + (group | if is_last { 0 } else { 0x20 })));
                if is_last {
                    break;
                }
            }
        }
        text
    }

    /// `rleFrString` of the COCO API; `None` for text that `rleToString` never writes.
    fn decompressed(text: &str) -> Option<Vec<u32>> {
        let mut runs: Vec<u32> = Vec::new();
        let (mut value, mut shift) = (0_i64, 0);
        for byte in text.bytes() {
            let group = byte.checked_sub(48).filter(|&group| group < 64 && shift < 40)?;
            value |= i64::from(group & 0x1f) << shift;
            shift += 5;
            if group & 0x20 == 0 {
                if group & 0x10 != 0 {
                    value |= -1 << shift;
                }
                let before = runs.len().checked_sub(2).filter(|&before| before > 0);
                let before = before.and_then(|before| runs.get(before));
                runs.push(u32::try_from(value + before.map_or(0, |&before| i64::from(before))).ok()?);
                (value, shift) = (0, 0);
            }
        }
        (shift == 0).then_some(runs)
    }
}
