use crate::Error;

/// The focal length for which lengths in pixels are given, that of a Kinect.
const REFERENCE_FOCAL_LENGTH: f64 = 525.0;

/// A pinhole camera without distortion: image size in pixels, focal lengths and principal point in pixels.
///
/// A camera-frame point (x, y, z) appears at u = fx x / z + cx, v = fy y / z + cy. Focal lengths may be
/// negative: some rendered datasets (ICL-NUIM) flip an axis.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "RawCamera"))]
#[doc(alias = "intrinsics")]
#[doc(alias = "CameraInfo")]
#[doc(alias = "K")]
pub struct PinholeCamera {
    width: usize,
    height: usize,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
}

impl PinholeCamera {
    /// Largest number of pixels of an image: keeps every index and byte count far from overflow.
    pub const MAX_PIXELS: usize = 1 << 28;

    /// Makes a camera of `width` x `height` pixels.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`] when a side is zero or there are more than [`Self::MAX_PIXELS`] pixels;
    /// [`Error::Intrinsics`] when a focal length is not within 1e-3 to 1e9 pixels in magnitude or the
    /// principal point lies further out than 1e9 pixels.
    pub fn new(width: usize, height: usize, fx: f64, fy: f64, cx: f64, cy: f64) -> Result<Self, Error> {
        check_image_size(width, height)?;
        // Comparisons with NaN fail.
        let is_focal = |f: f64| (1e-3..=1e9).contains(&f.abs());
        let is_center = |c: f64| c.abs() <= 1e9;
        if !(is_focal(fx) && is_focal(fy) && is_center(cx) && is_center(cy)) {
            return Err(Error::Intrinsics { fx, fy, cx, cy });
        }
        Ok(Self { width, height, fx, fy, cx, cy })
    }

    /// Image width, pixels.
    #[inline]
    pub fn width(&self) -> usize {
        self.width
    }

    /// Image height, pixels.
    #[inline]
    pub fn height(&self) -> usize {
        self.height
    }

    /// Focal length along u, pixels.
    #[inline]
    pub fn fx(&self) -> f64 {
        self.fx
    }

    /// Focal length along v, pixels.
    #[inline]
    pub fn fy(&self) -> f64 {
        self.fy
    }

    /// Principal point, u.
    #[inline]
    pub fn cx(&self) -> f64 {
        self.cx
    }

    /// Principal point, v.
    #[inline]
    pub fn cy(&self) -> f64 {
        self.cy
    }

    /// The camera-frame point at pixel `[u, v]` and depth z = `depth` metres.
    ///
    /// ```
    /// let camera = dymlm_core::PinholeCamera::new(640, 480, 500.0, 500.0, 320.0, 240.0)?;
    /// assert_eq!(camera.back_project([420.0, 240.0], 2.0), [0.4, 0.0, 2.0]);
    /// assert_eq!(camera.project([0.4, 0.0, 2.0]), Some([420.0, 240.0]));
    /// assert_eq!(camera.project([0.4, 0.0, -2.0]), None);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    #[inline]
    pub fn back_project(&self, pixel: [f64; 2], depth: f64) -> [f64; 3] {
        [(pixel[0] - self.cx) / self.fx * depth, (pixel[1] - self.cy) / self.fy * depth, depth]
    }

    /// The pixel `[u, v]` at which a camera-frame point appears, inside the image or not; `None` when the
    /// point is not in front of the camera (z <= 0) or not finite.
    #[inline]
    pub fn project(&self, point: [f64; 3]) -> Option<[f64; 2]> {
        let [x, y, z] = point;
        let in_front = z > 0.0 && z.is_finite() && x.is_finite() && y.is_finite();
        in_front.then(|| [self.fx * x / z + self.cx, self.fy * y / z + self.cy])
    }

    /// How much finer than a Kinect's (f = 525 px at 640x480) the camera's pixels are: the geometric mean of
    /// its focal lengths over 525. A length in pixels that was chosen for a Kinect is multiplied by this
    /// factor.
    ///
    /// ```
    /// let camera = dymlm_core::PinholeCamera::new(1280, 960, 1050.0, 1050.0, 639.5, 479.5)?;
    /// assert_eq!(camera.focal_scale(), 2.0);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    #[inline]
    pub fn focal_scale(&self) -> f64 {
        (self.fx * self.fy).abs().sqrt() / REFERENCE_FOCAL_LENGTH
    }

    /// How much larger the image is than 640x480: the square root of the ratio of their pixel counts.
    #[inline]
    pub fn size_scale(&self) -> f64 {
        ((self.width * self.height) as f64 / (640.0 * 480.0)).sqrt()
    }

    /// The camera of the image of every `stride`-th pixel of every `stride`-th row of this camera's image:
    /// its pixel (i, j) is (i `stride`, j `stride`) here, so that focal lengths and principal point are
    /// divided by the stride exactly. A stride of 0 counts as 1.
    ///
    /// # Errors
    ///
    /// [`Error::Intrinsics`] when a focal length becomes less than 1e-3 pixels.
    ///
    /// ```
    /// let camera = dymlm_core::PinholeCamera::new(1280, 720, 910.0, 910.0, 641.0, 361.0)?;
    /// let half = camera.subsampled(2)?;
    /// assert_eq!((half.width(), half.height(), half.fx(), half.cx()), (640, 360, 455.0, 320.5));
    /// assert_eq!(half.back_project([100.0, 50.0], 2.0), camera.back_project([200.0, 100.0], 2.0));
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    pub fn subsampled(&self, stride: usize) -> Result<Self, Error> {
        let stride = stride.max(1);
        let [fx, fy, cx, cy] = [self.fx, self.fy, self.cx, self.cy].map(|value| value / stride as f64);
        Self::new(self.width.div_ceil(stride), self.height.div_ceil(stride), fx, fy, cx, cy)
    }

    /// Checks that an image has this camera's size; `what` names it in the error, for example "the depth
    /// image".
    ///
    /// # Errors
    ///
    /// [`Error::SizeMismatch`].
    pub fn check_size(&self, what: &'static str, width: usize, height: usize) -> Result<(), Error> {
        if (width, height) == (self.width, self.height) {
            return Ok(());
        }
        Err(Error::SizeMismatch {
            what,
            width: self.width,
            height: self.height,
            actual_width: width,
            actual_height: height,
        })
    }

    /// Whether `[u, v]` lies on the image: within half a pixel of a pixel's centre.
    #[inline]
    pub fn sees(&self, pixel: [f64; 2]) -> bool {
        (-0.5..self.width as f64 - 0.5).contains(&pixel[0])
            && (-0.5..self.height as f64 - 0.5).contains(&pixel[1])
    }
}

pub(crate) fn check_image_size(width: usize, height: usize) -> Result<usize, Error> {
    match width.checked_mul(height) {
        Some(pixels) if pixels > 0 && pixels <= PinholeCamera::MAX_PIXELS => Ok(pixels),
        _ => Err(Error::ImageSize { width, height }),
    }
}

/// Checks an image's size and that its buffer of `actual` pixels fits it: what every image type does in its
/// `new`.
///
/// # Errors
///
/// [`Error::ImageSize`], [`Error::BufferLength`].
pub fn check_buffer(width: usize, height: usize, actual: usize) -> Result<(), Error> {
    let expected = check_image_size(width, height)?;
    if actual == expected { Ok(()) } else { Err(Error::BufferLength { width, height, expected, actual }) }
}

/// Checks that a foreign buffer of `actual` values holds rows of `size[0]` values, each `row_stride` after
/// the one before.
pub(crate) fn check_rows(size: [usize; 2], row_stride: usize, actual: usize) -> Result<(), Error> {
    let expected = (size[1] - 1).checked_mul(row_stride).and_then(|last| last.checked_add(size[0]));
    match expected {
        Some(expected) if row_stride >= size[0] && actual >= expected => Ok(()),
        _ => Err(Error::RowStride { size, row_stride, expected: expected.unwrap_or(usize::MAX), actual }),
    }
}

#[cfg(feature = "serde")]
#[derive(serde::Deserialize)]
struct RawCamera {
    width: usize,
    height: usize,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
}

#[cfg(feature = "serde")]
impl TryFrom<RawCamera> for PinholeCamera {
    type Error = Error;

    fn try_from(raw: RawCamera) -> Result<Self, Error> {
        Self::new(raw.width, raw.height, raw.fx, raw.fy, raw.cx, raw.cy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_sizes_and_intrinsics_that_are_no_camera() {
        assert!(matches!(PinholeCamera::new(0, 480, 1.0, 1.0, 0.0, 0.0), Err(Error::ImageSize { .. })));
        assert!(matches!(
            PinholeCamera::new(usize::MAX, 2, 1.0, 1.0, 0.0, 0.0),
            Err(Error::ImageSize { .. })
        ));
        assert!(matches!(PinholeCamera::new(2, 2, 0.0, 1.0, 0.0, 0.0), Err(Error::Intrinsics { .. })));
        assert!(matches!(PinholeCamera::new(2, 2, 1e-300, 1.0, 0.0, 0.0), Err(Error::Intrinsics { .. })));
        assert!(matches!(PinholeCamera::new(2, 2, 1.0, f64::NAN, 0.0, 0.0), Err(Error::Intrinsics { .. })));
        assert!(matches!(
            PinholeCamera::new(2, 2, 1.0, 1.0, f64::INFINITY, 0.0),
            Err(Error::Intrinsics { .. })
        ));
    }

    #[test]
    fn a_negative_focal_length_flips_an_axis() {
        let camera = PinholeCamera::new(640, 480, 481.2, -480.0, 319.5, 239.5).unwrap();
        assert!(camera.back_project([319.5, 0.0], 1.0)[1] > 0.0);
    }

    #[test]
    fn nan_is_not_in_front() {
        let camera = PinholeCamera::new(640, 480, 500.0, 500.0, 320.0, 240.0).unwrap();
        assert_eq!(camera.project([0.0, 0.0, f64::NAN]), None);
        assert_eq!(camera.project([0.0, 0.0, 0.0]), None);
        assert_eq!(camera.project([0.0, 0.0, f64::INFINITY]), None);
        assert_eq!(camera.project([f64::NAN, 0.0, 1.0]), None);
    }
}
