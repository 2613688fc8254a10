use dymlm_core::Plane;

use crate::moments::Moments;

/// One plane of an image: a set of pixels and the plane fitted to them. Camera frame.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Segment {
    /// The least-squares plane; its normal points to the camera.
    pub plane: Plane,
    /// Mean of its points, metres.
    pub centroid: [f64; 3],
    /// Mean squared distance of its points from the plane, square metres.
    pub mse: f64,
    /// Number of its pixels.
    pub support: usize,
    /// Sums over its points, each of weight 1.
    pub(crate) moments: Moments,
}

/// The planes of one image, and to which of them each pixel belongs.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Extraction {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) labels: Vec<u16>,
    pub(super) segments: Vec<Segment>,
}

impl Extraction {
    /// Width of the image, pixels.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Height of the image, pixels.
    pub fn height(&self) -> usize {
        self.height
    }

    /// The planes, largest support first.
    pub fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// For each pixel, row by row: 0 = no plane, k = `segments()[k - 1]`. As such it can be saved as a picture.
    pub fn labels(&self) -> &[u16] {
        &self.labels
    }

    /// Index into [`Extraction::segments`] of the plane at pixel (u, v); `None` where there is none or outside.
    pub fn segment_at(&self, u: usize, v: usize) -> Option<usize> {
        let label = if u < self.width { *self.labels.get(v * self.width + u)? } else { 0 };
        usize::from(label).checked_sub(1)
    }
}
