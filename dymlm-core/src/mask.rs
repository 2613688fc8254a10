use std::ops::Range;

use crate::pinhole_camera::{check_buffer, check_image_size};
use crate::{BoundingBox, Error};

/// A set of pixels of an image, one bit per pixel.
///
/// `true` always means that the pixel belongs to what the mask is named after: a *static* mask is true where
/// the scene is static, an *instance* mask where the image shows the object, a mask of *movers* where it
/// shows one.
///
/// Each row begins at a word of 64 bits, so that rows are slices of words ([`Self::row_words`]): pixel (u, v)
/// is bit u % 64 of word u / 64 of row v. The bits after a row's last pixel are 0.
///
/// ```
/// use dymlm_core::Mask;
///
/// let mut is_static = Mask::filled(640, 480, true)?;
/// is_static.fill_row(100, 200..300, false);
/// assert!(is_static.at(199, 100) && !is_static.at(200, 100) && is_static.at(200, 101));
/// assert_eq!(is_static.count(), 640 * 480 - 100);
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, PartialEq, Eq)]
#[doc(alias = "segmentation")]
#[doc(alias = "bitmap")]
pub struct Mask {
    width: usize,
    height: usize,
    /// `words_per_row` words per row.
    words: Vec<u64>,
}

pub(crate) const WORD: usize = u64::BITS as usize;

impl Clone for Mask {
    fn clone(&self) -> Self {
        Self { words: self.words.clone(), ..*self }
    }

    /// Allocates only when the mask grows.
    fn clone_from(&mut self, mask: &Self) {
        (self.width, self.height) = (mask.width, mask.height);
        self.words.clone_from(&mask.words);
    }
}

impl Mask {
    /// Takes one `bool` per pixel, row by row from the top left.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`], [`Error::BufferLength`].
    #[expect(clippy::needless_pass_by_value, reason = "buffers are given as those of the other images are")]
    pub fn new(width: usize, height: usize, pixels: Vec<bool>) -> Result<Self, Error> {
        check_buffer(width, height, pixels.len())?;
        let words = pixels.chunks_exact(width).flat_map(|row| row.chunks(WORD).map(pack)).collect();
        Ok(Self { width, height, words })
    }

    /// Takes rows of words as [`Self::row_words`] gives them; bits after a row's last pixel are left out.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`]; [`Error::BufferLength`] counts words.
    pub fn from_words(width: usize, height: usize, words: Vec<u64>) -> Result<Self, Error> {
        check_image_size(width, height)?;
        let per_row = width.div_ceil(WORD);
        let (expected, actual) = (per_row * height, words.len());
        if expected != actual {
            return Err(Error::BufferLength { width, height, expected, actual });
        }
        let mut mask = Self { width, height, words };
        if !width.is_multiple_of(WORD) {
            let behind = !0 << (width % WORD);
            mask.words.iter_mut().skip(per_row - 1).step_by(per_row).for_each(|word| *word &= !behind);
        }
        Ok(mask)
    }

    /// The pixels for which `belongs(u, v)` is true; it is called row by row.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`].
    pub fn from_fn(
        width: usize,
        height: usize,
        mut belongs: impl FnMut(usize, usize) -> bool,
    ) -> Result<Self, Error> {
        let mut mask = Self::filled(width, height, false)?;
        for (v, row) in mask.words.chunks_exact_mut(width.div_ceil(WORD)).enumerate() {
            for u in 0..width {
                row[u / WORD] |= u64::from(belongs(u, v)) << (u % WORD);
            }
        }
        Ok(mask)
    }

    /// A mask with the same value at every pixel.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`].
    pub fn filled(width: usize, height: usize, value: bool) -> Result<Self, Error> {
        check_image_size(width, height)?;
        let mut mask = Self::unset(width, height);
        if value {
            mask.fill(true);
        }
        Ok(mask)
    }

    /// A mask of a checked size without any pixel.
    pub(crate) fn unset(width: usize, height: usize) -> Self {
        Self { width, height, words: vec![0; height * width.div_ceil(WORD)] }
    }

    /// Sets 64 pixels of row `v`; those after the row's last pixel are 0. Nothing happens below the image.
    pub(crate) fn set_word(&mut self, v: usize, index: usize, bits: u64) {
        let index = v * self.words_per_row() + index;
        if let Some(word) = self.words.get_mut(index) {
            *word = bits;
        }
    }

    /// Gives the mask another size and every pixel the same value; allocates only when it grows.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`]; the mask stays as it was.
    pub fn refill(&mut self, width: usize, height: usize, value: bool) -> Result<(), Error> {
        check_image_size(width, height)?;
        (self.width, self.height) = (width, height);
        self.words.resize(height * self.words_per_row(), 0);
        self.fill(value);
        Ok(())
    }

    /// Makes this mask every `stride`-th pixel of every `stride`-th row of another, as
    /// [`DepthImage::subsample_from`](crate::DepthImage::subsample_from) does.
    pub fn subsample_from(&mut self, mask: &Self, stride: usize) {
        let stride = stride.max(1);
        (self.width, self.height) = (mask.width.div_ceil(stride), mask.height.div_ceil(stride));
        self.words.clear();
        self.words.resize(self.height * self.words_per_row(), 0);
        for v in 0..self.height {
            let row = v * self.words_per_row();
            for u in mask.columns_of_row(v * stride).filter(|u| u.is_multiple_of(stride)) {
                self.words[row + u / stride / WORD] |= 1 << (u / stride % WORD);
            }
        }
    }

    /// Width, pixels.
    #[inline]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height, pixels.
    #[inline]
    pub fn height(&self) -> usize {
        self.height
    }

    /// The value at pixel (u, v); `false` outside the image.
    #[inline]
    pub fn at(&self, u: usize, v: usize) -> bool {
        if u >= self.width || v >= self.height {
            return false;
        }
        let word = self.words.get(v * self.words_per_row() + u / WORD);
        word.is_some_and(|word| word >> (u % WORD) & 1 == 1)
    }

    /// Sets the value at pixel (u, v); nothing happens outside the image.
    #[inline]
    pub fn set(&mut self, u: usize, v: usize, value: bool) {
        if u >= self.width || v >= self.height {
            return;
        }
        let index = v * self.words_per_row() + u / WORD;
        if let Some(word) = self.words.get_mut(index) {
            let bit = 1 << (u % WORD);
            *word = if value { *word | bit } else { *word & !bit };
        }
    }

    /// Sets all pixels.
    pub fn fill(&mut self, value: bool) {
        self.words.fill(if value { u64::MAX } else { 0 });
        if value && !self.width.is_multiple_of(WORD) {
            let words_per_row = self.words_per_row();
            for last in self.words.iter_mut().skip(words_per_row - 1).step_by(words_per_row) {
                *last = ones(0..self.width % WORD);
            }
        }
    }

    /// Sets some columns of row `v`; columns and rows outside the image are ignored.
    pub fn fill_row(&mut self, v: usize, columns: Range<usize>, value: bool) {
        let columns = columns.start..columns.end.min(self.width);
        if v >= self.height || columns.is_empty() {
            return;
        }
        let row = v * self.words_per_row();
        for index in columns.start / WORD..columns.end.div_ceil(WORD) {
            let start = columns.start.saturating_sub(index * WORD);
            let bits = ones(start..(columns.end - index * WORD).min(WORD));
            let word = &mut self.words[row + index];
            *word = if value { *word | bits } else { *word & !bits };
        }
    }

    /// Sets all pixels whose centres lie in a box.
    pub fn fill_box(&mut self, bounding_box: &BoundingBox, value: bool) {
        for v in bounding_box.rows(self.height) {
            self.fill_row(v, bounding_box.columns(self.width), value);
        }
    }

    /// Number of pixels that are `true`.
    pub fn count(&self) -> usize {
        self.words.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The words of row `v`, 64 pixels each, the leftmost in the lowest bit; an empty slice below the image.
    #[inline]
    pub fn row_words(&self, v: usize) -> &[u64] {
        self.words.chunks_exact(self.words_per_row()).nth(v).unwrap_or(&[])
    }

    /// The values of row `v` from left to right; none below the image.
    pub fn row(&self, v: usize) -> impl Iterator<Item = bool> + Clone + '_ {
        let words = self.row_words(v);
        let width = if words.is_empty() { 0 } else { self.width };
        (0..width).map(move |u| words[u / WORD] >> (u % WORD) & 1 == 1)
    }

    /// The values of all pixels, row by row.
    pub fn pixels(&self) -> impl Iterator<Item = bool> + Clone + '_ {
        (0..self.height).flat_map(|v| self.row(v))
    }

    /// The columns of row `v` that are `true`, from left to right.
    pub fn columns_of_row(&self, v: usize) -> impl Iterator<Item = usize> + Clone + '_ {
        self.row_words(v).iter().enumerate().flat_map(|(index, &word)| {
            let rest = std::iter::successors(Some(word), |rest| Some(rest & rest.wrapping_sub(1)));
            let bits = rest.take_while(|&rest| rest != 0);
            bits.map(move |rest| index * WORD + rest.trailing_zeros() as usize)
        })
    }

    /// Overwrites the values of a row, one per pixel, wherever row `v` of the mask is `false`: for instance
    /// to mask a row of a depth image. Costs little where 64 consecutive pixels are equal.
    #[inline]
    pub fn overwrite_outside<T: Copy>(&self, v: usize, row: &mut [T], value: T) {
        for (values, &word) in row.chunks_mut(WORD).zip(self.row_words(v)) {
            match word {
                u64::MAX => {}
                0 => values.fill(value),
                _ => {
                    for (bit, kept) in values.iter_mut().enumerate() {
                        *kept = if word >> bit & 1 == 1 { *kept } else { value };
                    }
                }
            }
        }
    }

    /// The mask that is `true` where this one is not.
    #[must_use]
    pub fn inverted(&self) -> Self {
        let mut inverted = Self { words: vec![0; self.words.len()], ..*self };
        inverted.fill(true);
        for (word, taken) in inverted.words.iter_mut().zip(&self.words) {
            *word &= !taken;
        }
        inverted
    }

    /// Makes pixels `true` that are `true` in another mask of the same size: the union.
    ///
    /// # Errors
    ///
    /// [`Error::MaskSize`]; the mask stays as it was.
    pub fn unite(&mut self, other: &Self) -> Result<(), Error> {
        self.combine(other, |a, b| a | b)
    }

    /// Makes pixels `false` that are `true` in another mask of the same size: the difference.
    ///
    /// # Errors
    ///
    /// [`Error::MaskSize`]; the mask stays as it was.
    pub fn subtract(&mut self, other: &Self) -> Result<(), Error> {
        self.combine(other, |a, b| a & !b)
    }

    fn combine(&mut self, other: &Self, both: impl Fn(u64, u64) -> u64) -> Result<(), Error> {
        if (self.width, self.height) != (other.width, other.height) {
            let [size, other] = [self, other].map(|mask| [mask.width, mask.height]);
            return Err(Error::MaskSize { size, other });
        }
        self.words.iter_mut().zip(&other.words).for_each(|(word, &other)| *word = both(*word, other));
        Ok(())
    }

    #[inline]
    fn words_per_row(&self) -> usize {
        self.width.div_ceil(WORD)
    }
}

/// At most 64 pixels as bits, the first in the lowest.
fn pack(pixels: &[bool]) -> u64 {
    pixels.iter().rev().fold(0, |word, &pixel| word << 1 | u64::from(pixel))
}

/// A word with ones at some bits.
pub(crate) fn ones(bits: Range<usize>) -> u64 {
    u64::MAX >> (WORD - bits.len()) << bits.start
}
