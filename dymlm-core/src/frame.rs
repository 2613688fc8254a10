use crate::{ColorImage, DepthImage, Error, PinholeCamera};

/// One RGB-D frame: depth and colour, registered pixel by pixel and seen by one camera at one time.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    timestamp: f64,
    camera: PinholeCamera,
    depth: DepthImage,
    color: Option<ColorImage>,
}

impl Frame {
    /// Puts a frame together. `timestamp` is in seconds, from any origin. Without a colour image the maps
    /// have no colours.
    ///
    /// # Errors
    ///
    /// [`Error::Timestamp`] when the time is not finite; [`Error::SizeMismatch`] when an image is of another
    /// size than the camera.
    pub fn new(
        timestamp: f64,
        camera: PinholeCamera,
        depth: DepthImage,
        color: Option<ColorImage>,
    ) -> Result<Self, Error> {
        if !timestamp.is_finite() {
            return Err(Error::Timestamp(timestamp));
        }
        camera.check_size("the depth image", depth.width(), depth.height())?;
        if let Some(color) = &color {
            camera.check_size("the colour image", color.width(), color.height())?;
        }
        Ok(Self { timestamp, camera, depth, color })
    }

    /// The frame with every `stride`-th pixel of every `stride`-th row, and the camera that sees just these:
    /// its pixel (i, j) is (i `stride`, j `stride`) here. Work on it costs 1/`stride`^2. A stride of 0 counts
    /// as 1.
    ///
    /// # Errors
    ///
    /// [`Error::Intrinsics`] when a focal length becomes less than 1e-3 pixels.
    ///
    /// ```
    /// use dymlm_core::{DepthImage, Frame, PinholeCamera};
    ///
    /// let camera = PinholeCamera::new(1280, 720, 910.0, 910.0, 640.0, 360.0)?;
    /// let frame = Frame::new(0.0, camera, DepthImage::new(1280, 720, vec![2.0; 1280 * 720])?, None)?;
    /// let half = frame.subsampled(2)?;
    /// assert_eq!((half.depth().width(), half.camera().fx()), (640, 455.0));
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    pub fn subsampled(&self, stride: usize) -> Result<Self, Error> {
        let depth = DepthImage::empty(1, 1)?;
        let mut frame = Self { timestamp: self.timestamp, camera: self.camera, depth, color: None };
        self.subsample_into(stride, &mut frame)?;
        Ok(frame)
    }

    /// [`Self::subsampled`] into a frame that is no longer needed: with one of the same size nothing is
    /// allocated.
    ///
    /// # Errors
    ///
    /// As [`Self::subsampled`]; `frame` stays as it was.
    pub fn subsample_into(&self, stride: usize, frame: &mut Self) -> Result<(), Error> {
        frame.camera = self.camera.subsampled(stride)?;
        frame.timestamp = self.timestamp;
        frame.depth.subsample_from(&self.depth, stride);
        if let Some(color) = &self.color {
            frame.color.get_or_insert_with(ColorImage::nothing).subsample_from(color, stride);
        } else {
            frame.color = None;
        }
        Ok(())
    }

    /// Gives the frame another time, seconds.
    ///
    /// # Errors
    ///
    /// [`Error::Timestamp`] when it is not finite; the frame stays as it was.
    pub fn set_timestamp(&mut self, timestamp: f64) -> Result<(), Error> {
        if !timestamp.is_finite() {
            return Err(Error::Timestamp(timestamp));
        }
        self.timestamp = timestamp;
        Ok(())
    }

    /// Time of the exposure, seconds.
    #[inline]
    pub fn timestamp(&self) -> f64 {
        self.timestamp
    }

    /// The camera that saw it.
    #[inline]
    pub fn camera(&self) -> &PinholeCamera {
        &self.camera
    }

    /// The depth image.
    #[inline]
    pub fn depth(&self) -> &DepthImage {
        &self.depth
    }

    pub(crate) fn depth_mut(&mut self) -> &mut DepthImage {
        &mut self.depth
    }

    /// The colour image, if there is one.
    #[inline]
    pub fn color(&self) -> Option<&ColorImage> {
        self.color.as_ref()
    }

    /// Gives the images back, so that their buffers can be used again.
    pub fn into_images(self) -> (DepthImage, Option<ColorImage>) {
        (self.depth, self.color)
    }
}
