use crate::Error;
use crate::pinhole_camera::check_buffer;

/// A choice of pixels, one `bool` a pixel, row by row from the top left. Its owner says what `true` means.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Mask {
    width: usize,
    height: usize,
    data: Vec<bool>,
}

impl Mask {
    /// Takes a buffer of `width * height` choices.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`], [`Error::BufferLength`].
    pub fn new(width: usize, height: usize, data: Vec<bool>) -> Result<Self, Error> {
        check_buffer(width, height, data.len())?;
        Ok(Self { width, height, data })
    }

    /// A mask with the same choice at every pixel.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`].
    pub fn filled(width: usize, height: usize, choice: bool) -> Result<Self, Error> {
        let pixels = crate::pinhole_camera::check_image_size(width, height)?;
        Ok(Self { width, height, data: vec![choice; pixels] })
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

    /// All choices, row by row.
    #[inline]
    pub fn data(&self) -> &[bool] {
        &self.data
    }

    /// All choices, to be changed in place.
    #[inline]
    pub fn data_mut(&mut self) -> &mut [bool] {
        &mut self.data
    }

    /// The choice at pixel (u, v); `false` outside the image.
    #[inline]
    pub fn at(&self, u: usize, v: usize) -> bool {
        u < self.width && self.data.get(v * self.width + u).copied().unwrap_or(false)
    }

    /// Number of chosen pixels.
    pub fn count(&self) -> usize {
        self.data.iter().filter(|&&choice| choice).count()
    }
}
