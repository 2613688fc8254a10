use crate::Error;
use crate::pinhole_camera::{check_buffer, check_image_size, check_rows};

/// A depth image in metres along the optical axis, row by row from the top left. 0 = no reading.
///
/// Whatever is no reading (0, negative, NaN, infinite) is stored as 0, once, when the image is made: all
/// later code only tests `depth > 0.0`.
///
/// ```
/// use dymlm_core::DepthImage;
///
/// // A driver's buffer: millimetres, rows of three values of which two are pixels.
/// let mut depth = DepthImage::empty(2, 2)?;
/// depth.refill_from_u16(&[1000, 2000, 0, 0, 4000, 0], 3, 1000.0)?;
/// assert_eq!(depth.data(), [1.0, 2.0, 0.0, 4.0]);
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct DepthImage {
    width: usize,
    height: usize,
    data: Vec<f32>,
}

impl DepthImage {
    /// Takes a buffer of `width * height` depths in metres.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`], [`Error::BufferLength`].
    ///
    /// ```
    /// let depth = dymlm_core::DepthImage::new(2, 2, vec![1.5, f32::NAN, -1.0, f32::INFINITY])?;
    /// assert_eq!(depth.data(), [1.5, 0.0, 0.0, 0.0]);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    pub fn new(width: usize, height: usize, mut data: Vec<f32>) -> Result<Self, Error> {
        check_buffer(width, height, data.len())?;
        for depth in &mut data {
            *depth = reading(*depth);
        }
        Ok(Self { width, height, data })
    }

    /// An image without any reading, to be filled.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`].
    pub fn empty(width: usize, height: usize) -> Result<Self, Error> {
        Ok(Self { width, height, data: vec![0.0; check_image_size(width, height)?] })
    }

    /// Converts stored integers to metres: depth = value / `depth_scale`; 5000 for TUM PNGs, 1000 for
    /// millimetres.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`], [`Error::BufferLength`], [`Error::DepthScale`].
    pub fn from_u16(width: usize, height: usize, data: &[u16], depth_scale: f64) -> Result<Self, Error> {
        check_buffer(width, height, data.len())?;
        let mut image = Self::empty(width, height)?;
        image.refill_from_u16(data, width, depth_scale)?;
        Ok(image)
    }

    /// Replaces the readings by a sensor's integers, without allocating: depth = value / `depth_scale`. A row
    /// of the buffer begins `row_stride` values after the one before; values after its last pixel are
    /// ignored.
    ///
    /// # Errors
    ///
    /// [`Error::RowStride`] when the rows overlap or the buffer ends too early; [`Error::DepthScale`]. The
    /// image stays as it was.
    #[doc(alias = "16UC1")]
    pub fn refill_from_u16(
        &mut self,
        data: &[u16],
        row_stride: usize,
        depth_scale: f64,
    ) -> Result<(), Error> {
        if !(depth_scale.is_finite() && depth_scale > 0.0) {
            return Err(Error::DepthScale(depth_scale));
        }
        let metres = (1.0 / depth_scale) as f32;
        self.refill(data, row_stride, |value| reading(f32::from(value) * metres))
    }

    /// Replaces the readings by others in metres, without allocating; `row_stride` as in
    /// [`Self::refill_from_u16`].
    ///
    /// # Errors
    ///
    /// [`Error::RowStride`]. The image stays as it was.
    #[doc(alias = "32FC1")]
    pub fn refill_from_metres(&mut self, data: &[f32], row_stride: usize) -> Result<(), Error> {
        self.refill(data, row_stride, reading)
    }

    fn refill<T: Copy>(
        &mut self,
        data: &[T],
        row_stride: usize,
        depth: impl Fn(T) -> f32,
    ) -> Result<(), Error> {
        check_rows([self.width, self.height], row_stride, data.len())?;
        for (row, values) in self.data.chunks_exact_mut(self.width).zip(data.chunks(row_stride)) {
            row.iter_mut().zip(values).for_each(|(out, &value)| *out = depth(value));
        }
        Ok(())
    }

    /// Makes this image every `stride`-th pixel of every `stride`-th row of another: pixel (i, j) is (i
    /// `stride`, j `stride`) there. Allocates only when the image grows; a stride of 0 counts as 1.
    pub fn subsample_from(&mut self, image: &Self, stride: usize) {
        let stride = stride.max(1);
        if stride == 1 {
            return self.replace(image.width, image.height, image.data.iter().copied());
        }
        let rows = image.data.chunks_exact(image.width).step_by(stride);
        let pixels = rows.flat_map(|row| row.iter().step_by(stride).copied());
        self.replace(image.width.div_ceil(stride), image.height.div_ceil(stride), pixels);
    }

    /// Gives the image another size and content; `pixels` must have `width * height` items. Allocates only
    /// when it grows.
    pub(crate) fn replace(&mut self, width: usize, height: usize, pixels: impl Iterator<Item = f32>) {
        (self.width, self.height) = (width, height);
        self.data.clear();
        self.data.extend(pixels);
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

    /// All depths, row by row.
    #[inline]
    pub fn data(&self) -> &[f32] {
        &self.data
    }

    pub(crate) fn data_mut(&mut self) -> &mut [f32] {
        &mut self.data
    }

    /// One row of depths, or an empty slice below the image.
    #[inline]
    pub fn row(&self, v: usize) -> &[f32] {
        self.data.chunks_exact(self.width).nth(v).unwrap_or(&[])
    }

    /// The depth at pixel (u, v); 0 when there is no reading or the pixel lies outside the image.
    #[inline]
    pub fn at(&self, u: usize, v: usize) -> f32 {
        let is_inside = u < self.width && v < self.height;
        if is_inside { self.data.get(v * self.width + u).copied().unwrap_or(0.0) } else { 0.0 }
    }

    /// Gives the buffer back, so that the next frame can be read into it.
    pub fn into_data(self) -> Vec<f32> {
        self.data
    }
}

/// The depth, or 0 where it is no reading.
#[inline]
fn reading(depth: f32) -> f32 {
    // NaN fails both comparisons.
    if depth > 0.0 && depth < f32::INFINITY { depth } else { 0.0 }
}
