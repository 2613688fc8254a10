use std::ops::Range;

use crate::Error;

/// A box in the image, half-open: [`x_min`, `x_max`) x [`y_min`, `y_max`), pixels. It may reach beyond the
/// image, and may be empty.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "[f32; 4]", into = "[f32; 4]"))]
pub struct BoundingBox {
    x_min: f32,
    y_min: f32,
    x_max: f32,
    y_max: f32,
}

impl BoundingBox {
    /// Makes the box [`x_min`, `x_max`) x [`y_min`, `y_max`).
    ///
    /// # Errors
    ///
    /// [`Error::BoundingBox`] when a side is not finite or the box ends before it begins.
    pub fn new(x_min: f32, y_min: f32, x_max: f32, y_max: f32) -> Result<Self, Error> {
        let finite = [x_min, y_min, x_max, y_max].iter().all(|side| side.is_finite());
        if finite && x_min <= x_max && y_min <= y_max {
            Ok(Self { x_min, y_min, x_max, y_max })
        } else {
            Err(Error::BoundingBox { x_min, y_min, x_max, y_max })
        }
    }

    /// Left side, pixels.
    #[inline]
    pub fn x_min(&self) -> f32 {
        self.x_min
    }

    /// Upper side, pixels.
    #[inline]
    pub fn y_min(&self) -> f32 {
        self.y_min
    }

    /// Right side, pixels.
    #[inline]
    pub fn x_max(&self) -> f32 {
        self.x_max
    }

    /// Lower side, pixels.
    #[inline]
    pub fn y_max(&self) -> f32 {
        self.y_max
    }

    /// Width, pixels.
    #[inline]
    pub fn width(&self) -> f32 {
        self.x_max - self.x_min
    }

    /// Height, pixels.
    #[inline]
    pub fn height(&self) -> f32 {
        self.y_max - self.y_min
    }

    /// Area, square pixels.
    #[inline]
    pub fn area(&self) -> f32 {
        self.width() * self.height()
    }

    /// Centre `[u, v]`, pixels.
    #[inline]
    pub fn center(&self) -> [f32; 2] {
        [f32::midpoint(self.x_min, self.x_max), f32::midpoint(self.y_min, self.y_max)]
    }

    /// Whether a point lies in the box, its sides `x_min` and `y_min` included, `x_max` and `y_max` not;
    /// pixels.
    #[inline]
    pub fn contains(&self, [u, v]: [f32; 2]) -> bool {
        (self.x_min..self.x_max).contains(&u) && (self.y_min..self.y_max).contains(&v)
    }

    /// Intersection over union, 0..=1; 0 when both boxes are empty.
    ///
    /// ```
    /// use dymlm_core::BoundingBox;
    ///
    /// let a = BoundingBox::new(0.0, 0.0, 10.0, 10.0)?;
    /// let b = BoundingBox::new(5.0, 0.0, 15.0, 10.0)?;
    /// assert_eq!(a.iou(&b), 1.0 / 3.0);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    #[inline]
    pub fn iou(&self, other: &Self) -> f64 {
        let [own, others, shared] = self.areas_with(other);
        let union = own + others - shared;
        if union > 0.0 { shared / union } else { 0.0 }
    }

    /// Share of this box's area that lies in another box, 0..=1; 0 when this box is empty.
    ///
    /// ```
    /// use dymlm_core::BoundingBox;
    ///
    /// let a = BoundingBox::new(0.0, 0.0, 10.0, 10.0)?;
    /// let b = BoundingBox::new(5.0, 0.0, 50.0, 10.0)?;
    /// assert_eq!(a.share_in(&b), 0.5);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    pub fn share_in(&self, other: &Self) -> f64 {
        let [own, _, shared] = self.areas_with(other);
        if own > 0.0 { shared / own } else { 0.0 }
    }

    /// The areas of this box, of another one and of what they share. In f64 no area overflows, and the areas
    /// of boxes on whole pixels are exact.
    #[inline]
    fn areas_with(&self, other: &Self) -> [f64; 3] {
        let [a, b] = [self, other].map(|b| <[f32; 4]>::from(*b).map(f64::from));
        let area =
            |[x_min, y_min, x_max, y_max]: [f64; 4]| (x_max - x_min).max(0.0) * (y_max - y_min).max(0.0);
        let shared = area([a[0].max(b[0]), a[1].max(b[1]), a[2].min(b[2]), a[3].min(b[3])]);
        [area(a), area(b), shared]
    }

    /// The part of the box on an image of `width` x `height` pixels; `None` when there is none.
    pub fn clipped(&self, width: usize, height: usize) -> Option<Self> {
        let clipped = Self {
            x_min: self.x_min.max(0.0),
            y_min: self.y_min.max(0.0),
            x_max: self.x_max.min(width as f32),
            y_max: self.y_max.min(height as f32),
        };
        (clipped.x_min < clipped.x_max && clipped.y_min < clipped.y_max).then_some(clipped)
    }

    /// The box in the image of every `stride`-th pixel of every `stride`-th row of this box's image: it holds
    /// exactly those of the image's pixels that this box holds.
    ///
    /// ```
    /// use dymlm_core::BoundingBox;
    ///
    /// let half = BoundingBox::new(3.0, 0.0, 9.0, 8.0)?.subsampled(2);
    /// assert_eq!(half.columns(640), 2..5, "the columns 4, 6 and 8");
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    #[must_use]
    pub fn subsampled(&self, stride: usize) -> Self {
        self.mapped(|sides| sides.map(|side| side / stride.max(1) as f32))
    }

    /// The box in an image of which this box's image is every `stride`-th pixel of every `stride`-th row:
    /// undoes [`subsampled`](Self::subsampled).
    #[must_use]
    pub fn upsampled(&self, stride: usize) -> Self {
        self.mapped(|sides| sides.map(|side| side * stride.max(1) as f32))
    }

    /// The box whose sides are made from these by an increasing function of each.
    pub(crate) fn mapped(&self, map: impl Fn([f32; 4]) -> [f32; 4]) -> Self {
        let [x_min, y_min, x_max, y_max] = map((*self).into()).map(|side| side.clamp(f32::MIN, f32::MAX));
        Self { x_min, y_min, x_max, y_max }
    }

    /// Columns of an image of `width` pixels whose centres lie in the box.
    pub fn columns(&self, width: usize) -> Range<usize> {
        pixels_within(self.x_min, self.x_max, width)
    }

    /// Rows of an image of `height` pixels whose centres lie in the box.
    pub fn rows(&self, height: usize) -> Range<usize> {
        pixels_within(self.y_min, self.y_max, height)
    }
}

/// Integers i of 0..count with min <= i < max. (A float cast saturates, so absurd boxes are harmless.)
fn pixels_within(min: f32, max: f32, count: usize) -> Range<usize> {
    let first = (min.max(0.0).ceil() as usize).min(count);
    let end = (max.max(0.0).ceil() as usize).min(count);
    first..end.max(first)
}

impl TryFrom<[f32; 4]> for BoundingBox {
    type Error = Error;

    /// From `[x_min, y_min, x_max, y_max]`.
    fn try_from([x_min, y_min, x_max, y_max]: [f32; 4]) -> Result<Self, Error> {
        Self::new(x_min, y_min, x_max, y_max)
    }
}

impl From<BoundingBox> for [f32; 4] {
    /// To `[x_min, y_min, x_max, y_max]`.
    fn from(b: BoundingBox) -> Self {
        [b.x_min, b.y_min, b.x_max, b.y_max]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn half_open_boxes_tile_the_image() {
        let left = BoundingBox::new(-3.0, 0.0, 2.5, 4.0).unwrap();
        let right = BoundingBox::new(2.5, 0.0, 90.0, 4.0).unwrap();
        assert_eq!(left.columns(8), 0..3);
        assert_eq!(right.columns(8), 3..8);
        let holds = |point| [left.contains(point), right.contains(point)];
        assert_eq!(
            [holds([2.0, 0.0]), holds([2.5, 0.0]), holds([3.0, 4.0])],
            [[true, false], [false, true], [false; 2]]
        );
        assert_eq!(BoundingBox::new(20.0, 0.0, 30.0, 1.0).unwrap().columns(8), 8..8);
        assert_eq!(BoundingBox::new(-1e30, 0.0, 1e30, 1.0).unwrap().columns(8), 0..8);
    }

    #[test]
    fn refuses_boxes_that_are_none() {
        assert!(BoundingBox::new(1.0, 0.0, 0.0, 1.0).is_err());
        assert!(BoundingBox::new(f32::NAN, 0.0, 0.0, 1.0).is_err());
        assert!(BoundingBox::new(0.0, 0.0, f32::INFINITY, 1.0).is_err());
    }

    #[test]
    fn huge_boxes_overlap_as_others_do() {
        let huge = BoundingBox::new(-1e30, -1e30, 1e30, 1e30).unwrap();
        assert_eq!(huge.iou(&huge), 1.0);
        assert_eq!(BoundingBox::new(3e38, 0.0, f32::MAX, 1.0).unwrap().center()[1], 0.5);
        assert!(BoundingBox::new(3e38, 0.0, f32::MAX, 1.0).unwrap().center()[0].is_finite());
    }

    #[test]
    fn empty_boxes_overlap_nothing() {
        let empty = BoundingBox::new(1.0, 1.0, 1.0, 1.0).unwrap();
        assert_eq!(empty.iou(&empty), 0.0);
        assert_eq!(empty.clipped(10, 10), None);
    }
}
