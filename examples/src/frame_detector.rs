use std::fmt::Debug;
use std::path::Path;

use dymlm::core::{ColorImage, Detection};

use crate::AnyError;

/// A detector that runs on the images of a recording while its maps are built.
pub trait FrameDetector: Debug {
    /// The detections in an image, with boxes in its pixels.
    ///
    /// # Errors
    ///
    /// The reason why the detector could not process this image.
    fn detect(&mut self, image: &ColorImage) -> Result<Vec<Detection>, AnyError>;
}

/// Opens a detector from a network's file and, if there is one, a file with the names of its classes.
pub type OpenDetector = dyn Fn(&Path, Option<&Path>) -> Result<Box<dyn FrameDetector>, AnyError>;
