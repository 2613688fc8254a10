use dymlm_core::{ColorImage, Rgb, check_buffer};

use crate::Error;

/// A grey image of f32 values, 0 = black, 1 = white, row by row from the top left.
///
/// ```
/// use dymlm_core::ColorImage;
/// use dymlm_tracking::GrayImage;
///
/// let color = ColorImage::new(2, 1, vec![[255, 255, 255], [255, 0, 0]])?;
/// let gray = GrayImage::from_color(&color);
/// assert!((gray.at(0, 0) - 1.0).abs() < 1e-6 && (gray.at(1, 0) - 0.299).abs() < 1e-6);
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct GrayImage {
    width: usize,
    height: usize,
    data: Vec<f32>,
}

/// Weights of the luma of ITU-R BT.601 for channels of 0..=255.
const LUMA: [f32; 3] = [0.299 / 255.0, 0.587 / 255.0, 0.114 / 255.0];

impl GrayImage {
    /// Takes a buffer of `width * height` values. Values that are not finite become 0.
    ///
    /// # Errors
    ///
    /// [`dymlm_core::Error::ImageSize`], [`dymlm_core::Error::BufferLength`].
    pub fn new(width: usize, height: usize, mut data: Vec<f32>) -> Result<Self, Error> {
        check_buffer(width, height, data.len())?;
        for value in &mut data {
            *value = if value.is_finite() { *value } else { 0.0 };
        }
        Ok(Self { width, height, data })
    }

    /// An image without pixels, to be filled by [`Self::assign_color`].
    pub fn empty() -> Self {
        Self { width: 0, height: 0, data: Vec::new() }
    }

    /// The luma of a colour image (ITU-R BT.601).
    pub fn from_color(color: &ColorImage) -> Self {
        let mut image = Self::empty();
        image.assign_color(color);
        image
    }

    /// [`Self::from_color`] into this image's buffer.
    pub fn assign_color(&mut self, color: &ColorImage) {
        self.resize(color.width(), color.height());
        for (value, &[r, g, b]) in self.data.iter_mut().zip(color.data()) {
            *value = luma([r, g, b]);
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

    /// All values, row by row.
    #[inline]
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    /// The value at pixel (u, v); 0 outside the image.
    #[inline]
    pub fn at(&self, u: usize, v: usize) -> f32 {
        if u < self.width { self.data.get(v * self.width + u).copied().unwrap_or(0.0) } else { 0.0 }
    }

    /// Row `v`, or the nearest row of the image; empty when the image has no pixels.
    #[inline]
    pub(crate) fn clamped_row(&self, v: isize) -> &[f32] {
        let v = v.clamp(0, self.height.saturating_sub(1) as isize) as usize;
        self.data.get(v * self.width..(v + 1) * self.width).unwrap_or(&[])
    }

    /// Changes the image's size; its values are then old ones or 0.
    pub(crate) fn resize(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.data.resize(width * height, 0.0);
    }

    #[inline]
    pub(crate) fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.resize(other.width, other.height);
        self.data.copy_from_slice(&other.data);
    }
}

#[inline]
fn luma([r, g, b]: Rgb) -> f32 {
    LUMA[0] * f32::from(r) + LUMA[1] * f32::from(g) + LUMA[2] * f32::from(b)
}
