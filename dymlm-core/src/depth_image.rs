use crate::Error;
use crate::pinhole_camera::check_buffer;

/// A depth image in metres along the optical axis, row by row from the top left. 0 = no reading.
///
/// Whatever is no reading (0, negative, NaN, infinite) is stored as 0, once, when the image is made: all later
/// code asks `depth > 0.0`.
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
            // NaN fails both comparisons.
            *depth = if *depth > 0.0 && *depth < f32::INFINITY { *depth } else { 0.0 };
        }
        Ok(Self { width, height, data })
    }

    /// Converts stored integers to metres: depth = value / `depth_scale`; 5000 for TUM PNGs, 1000 for millimetres.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`], [`Error::BufferLength`], [`Error::DepthScale`].
    pub fn from_u16(width: usize, height: usize, data: &[u16], depth_scale: f64) -> Result<Self, Error> {
        check_buffer(width, height, data.len())?;
        if !(depth_scale.is_finite() && depth_scale > 0.0) {
            return Err(Error::DepthScale(depth_scale));
        }
        let metres = (1.0 / depth_scale) as f32;
        Self::new(width, height, data.iter().map(|&value| f32::from(value) * metres).collect())
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

    /// One row of depths, or an empty slice below the image.
    #[inline]
    pub fn row(&self, v: usize) -> &[f32] {
        self.data.chunks_exact(self.width).nth(v).unwrap_or(&[])
    }

    /// The depth at pixel (u, v); 0 when there is no reading or the pixel lies outside the image.
    #[inline]
    pub fn at(&self, u: usize, v: usize) -> f32 {
        if u < self.width { self.data.get(v * self.width + u).copied().unwrap_or(0.0) } else { 0.0 }
    }

    /// Gives the buffer back, so that the next frame can be read into it.
    pub fn into_data(self) -> Vec<f32> {
        self.data
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_a_buffer_of_another_length() {
        assert_eq!(
            DepthImage::new(3, 2, vec![0.0; 5]),
            Err(Error::BufferLength { width: 3, height: 2, expected: 6, actual: 5 })
        );
        assert!(DepthImage::new(0, 0, Vec::new()).is_err());
    }

    #[test]
    fn scales_integers() {
        let depth = DepthImage::from_u16(2, 1, &[0, 10_000], 5000.0).unwrap();
        assert_eq!(depth.data(), [0.0, 2.0]);
        for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(DepthImage::from_u16(2, 1, &[0, 1], scale).is_err());
        }
    }

    #[test]
    fn outside_there_is_no_reading() {
        let depth = DepthImage::new(2, 2, vec![1.0; 4]).unwrap();
        assert_eq!([depth.at(1, 1), depth.at(2, 0), depth.at(0, 2)], [1.0, 0.0, 0.0]);
        assert_eq!(depth.row(1).len(), 2);
        assert!(depth.row(2).is_empty());
    }
}
