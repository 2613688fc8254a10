use crate::pinhole_camera::{check_buffer, check_image_size, check_rows};
use crate::{Error, Rgb};

/// A colour image, 8 bits per channel, row by row from the top left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColorImage {
    width: usize,
    height: usize,
    data: Vec<Rgb>,
}

/// How a foreign buffer holds colours, 8 bits per channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "lowercase"))]
#[non_exhaustive]
pub enum PixelFormat {
    /// Red, green, blue.
    Rgb8,
    /// Blue, green, red: the order of `OpenCV`.
    Bgr8,
    /// Red, green, blue, and a fourth byte that is ignored.
    Rgba8,
    /// Blue, green, red, and a fourth byte that is ignored.
    Bgra8,
}

impl PixelFormat {
    /// Bytes of a pixel.
    #[must_use]
    pub const fn bytes(self) -> usize {
        match self {
            Self::Rgb8 | Self::Bgr8 => 3,
            Self::Rgba8 | Self::Bgra8 => 4,
        }
    }
}

impl ColorImage {
    /// Takes a buffer of `width * height` colours.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`], [`Error::BufferLength`].
    pub fn new(width: usize, height: usize, data: Vec<Rgb>) -> Result<Self, Error> {
        check_buffer(width, height, data.len())?;
        Ok(Self { width, height, data })
    }

    /// Copies a foreign buffer. A row begins `row_stride` bytes after the one before; bytes after its last
    /// pixel are ignored.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`]; [`Error::RowStride`] when the rows overlap or the buffer ends too early.
    ///
    /// ```
    /// use dymlm_core::{ColorImage, PixelFormat};
    ///
    /// // Two rows of one pixel, blue first, padded to four bytes.
    /// let bytes = [30, 20, 10, 0, 33, 22, 11, 0];
    /// let image = ColorImage::from_bytes(1, 2, &bytes, PixelFormat::Bgr8, 4)?;
    /// assert_eq!(image.data(), [[10, 20, 30], [11, 22, 33]]);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    pub fn from_bytes(
        width: usize,
        height: usize,
        bytes: &[u8],
        format: PixelFormat,
        row_stride: usize,
    ) -> Result<Self, Error> {
        let pixels = check_image_size(width, height)?;
        check_rows([width * format.bytes(), height], row_stride, bytes.len())?;
        let mut image = Self { width, height, data: vec![[0; 3]; pixels] };
        image.refill_from_bytes(bytes, format, row_stride)?;
        Ok(image)
    }

    /// [`Self::from_bytes`] into this image, of its size, without allocating.
    ///
    /// # Errors
    ///
    /// [`Error::RowStride`]; the image stays as it was.
    pub fn refill_from_bytes(
        &mut self,
        bytes: &[u8],
        format: PixelFormat,
        row_stride: usize,
    ) -> Result<(), Error> {
        check_rows([self.width * format.bytes(), self.height], row_stride, bytes.len())?;
        for (row, bytes) in self.data.chunks_exact_mut(self.width).zip(bytes.chunks(row_stride)) {
            for (out, pixel) in row.iter_mut().zip(bytes.chunks_exact(format.bytes())) {
                *out = match (format, pixel) {
                    (PixelFormat::Rgb8 | PixelFormat::Rgba8, &[red, green, blue, ..])
                    | (PixelFormat::Bgr8 | PixelFormat::Bgra8, &[blue, green, red, ..]) => [red, green, blue],
                    _ => *out,
                };
            }
        }
        Ok(())
    }

    /// A placeholder without pixels, to be filled at once.
    pub(crate) fn nothing() -> Self {
        Self { width: 0, height: 0, data: Vec::new() }
    }

    /// Makes this image every `stride`-th pixel of every `stride`-th row of another, as
    /// [`DepthImage::subsample_from`](crate::DepthImage::subsample_from) does.
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
    pub(crate) fn replace(&mut self, width: usize, height: usize, pixels: impl Iterator<Item = Rgb>) {
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

    /// All colours, row by row.
    #[inline]
    pub fn data(&self) -> &[Rgb] {
        &self.data
    }

    /// The colour at pixel (u, v); `None` outside the image.
    #[inline]
    pub fn at(&self, u: usize, v: usize) -> Option<Rgb> {
        let is_inside = u < self.width && v < self.height;
        if is_inside { self.data.get(v * self.width + u).copied() } else { None }
    }

    /// Gives the buffer back, so that the next frame can be read into it.
    pub fn into_data(self) -> Vec<Rgb> {
        self.data
    }
}
