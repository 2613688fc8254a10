use crate::pinhole_camera::check_buffer;
use crate::{Error, Rgb};

/// A colour image, 8 bits a channel, row by row from the top left.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ColorImage {
    width: usize,
    height: usize,
    data: Vec<Rgb>,
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
        if u < self.width { self.data.get(v * self.width + u).copied() } else { None }
    }

    /// Gives the buffer back, so that the next frame can be read into it.
    pub fn into_data(self) -> Vec<Rgb> {
        self.data
    }
}
