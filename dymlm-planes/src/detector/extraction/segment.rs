use crate::moments::Fit;

/// One plane of an image: a set of pixels and the plane fitted to them. Camera frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(in crate::detector) struct Segment {
    /// The least-squares plane; its normal points to the camera.
    pub(in crate::detector) fit: Fit,
    /// Number of its pixels.
    pub(in crate::detector) support: usize,
    /// Whether it has no square of two by two flat blocks, before planes are merged: it is narrow, or a step
    /// between two surfaces.
    pub(in crate::detector) is_strip: bool,
}

/// The planes of one image, and the plane to which each pixel belongs.
#[derive(Debug, Clone, PartialEq, Default)]
pub(in crate::detector) struct Extraction {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) labels: Vec<u16>,
    pub(super) segments: Vec<Segment>,
}

impl Extraction {
    /// Width of the image, pixels.
    pub(in crate::detector) fn width(&self) -> usize {
        self.width
    }

    /// Height of the image, pixels.
    pub(in crate::detector) fn height(&self) -> usize {
        self.height
    }

    /// The planes, largest support first.
    pub(in crate::detector) fn segments(&self) -> &[Segment] {
        &self.segments
    }

    /// Whether the plane with a label is a strip; `false` for 0, no plane.
    pub(in crate::detector) fn is_strip(&self, label: u16) -> bool {
        let index = usize::from(label).checked_sub(1);
        index.and_then(|index| self.segments.get(index)).is_some_and(|segment| segment.is_strip)
    }

    /// For each pixel, row by row: 0 = no plane, k = `segments()[k - 1]`.
    pub(in crate::detector) fn labels(&self) -> &[u16] {
        &self.labels
    }

    /// Index into [`Extraction::segments`] of the plane at pixel (u, v) of the image, if there is one.
    pub(in crate::detector) fn segment_at(&self, u: usize, v: usize) -> Option<usize> {
        usize::from(self.labels[v * self.width + u]).checked_sub(1)
    }
}
