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
    /// Puts a frame together. `timestamp` is in seconds, from any origin. Without a colour image the maps have
    /// no colours.
    ///
    /// # Errors
    ///
    /// [`Error::Timestamp`] when the time is not finite; [`Error::SizeMismatch`] when an image is of another size
    /// than the camera.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refuses_images_of_another_size() {
        let camera = PinholeCamera::new(2, 2, 1.0, 1.0, 0.5, 0.5).unwrap();
        let depth = DepthImage::new(2, 2, vec![1.0; 4]).unwrap();
        let color = ColorImage::new(1, 2, vec![[0; 3]; 2]).unwrap();
        let error = Frame::new(0.0, camera, depth.clone(), Some(color)).unwrap_err();
        assert_eq!(error.to_string(), "the colour image has 1x2 pixels, the camera 2x2");
        assert!(Frame::new(f64::NAN, camera, depth, None).is_err());
    }
}
