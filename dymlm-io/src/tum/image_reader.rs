use std::path::Path;

use dymlm_core::{
    ColorImage, DepthImage, DepthRegistration, Distortion, Frame, PinholeCamera, Rectifier, Rgb,
};

use super::camera_file::CameraFile;
use crate::Error;
use crate::image_file::{DecodeBuffers, decode_color, decode_depth};

/// Reads the images of a dataset and converts them to those of one pinhole camera.
#[derive(Debug)]
pub(super) struct ImageReader {
    depth_scale: f64,
    cameras: CameraPair,
}

/// Converts stored colour and depth images to those of one pinhole camera.
#[derive(Debug)]
pub(crate) struct CameraPair {
    /// Camera of the frames, and of the stored colour images.
    pub(crate) camera: PinholeCamera,
    /// Removes the distortion of the colour images, if they have any.
    pub(crate) rectifier: Option<Rectifier>,
    /// Camera of the stored depth images.
    pub(crate) depth_camera: PinholeCamera,
    pub(crate) depth_rectifier: Option<Rectifier>,
    /// Registers depth images of another camera to the colour camera.
    pub(crate) registration: Option<DepthRegistration>,
}

/// Buffers for loading frames: a sequence that reuses them allocates next to nothing per frame.
#[derive(Debug, Clone, Default)]
pub struct FrameBuffers {
    pub(crate) decode: DecodeBuffers,
    pub(crate) depth: Vec<f32>,
    pub(crate) color: Vec<Rgb>,
    /// The images that rectification and registration write to.
    spare_depth: Option<DepthImage>,
    spare_color: Option<ColorImage>,
}

impl FrameBuffers {
    /// Takes back the image buffers of a frame, for the next frame.
    pub fn recycle(&mut self, frame: Frame) {
        let (depth, color) = frame.into_images();
        self.depth = depth.into_data();
        if let Some(color) = color {
            self.color = color.into_data();
        }
    }
}

impl ImageReader {
    pub(super) fn new(cameras: &CameraFile) -> Self {
        let camera = cameras.camera;
        let rectifier = |camera: &PinholeCamera, lens: Option<&Distortion>| {
            lens.map(|lens| Rectifier::new(camera, lens, camera))
        };
        let color = rectifier(&camera, cameras.distortion.as_ref());
        let (depth_camera, depth_rectifier, registration) = match &cameras.depth_camera {
            Some(depth) => (
                depth.camera,
                rectifier(&depth.camera, depth.distortion.as_ref()),
                Some(DepthRegistration::new(&depth.camera, &camera, &depth.color_from_depth)),
            ),
            // Depth images that are registered to distorted colour images have the same distortion.
            None => (camera, color.clone(), None),
        };
        let depth_scale = cameras.depth_scale;
        let cameras = CameraPair { camera, rectifier: color, depth_camera, depth_rectifier, registration };
        Self { depth_scale, cameras }
    }

    pub(super) fn camera(&self) -> &PinholeCamera {
        &self.cameras.camera
    }

    pub(super) fn rectifier(&self) -> Option<&Rectifier> {
        self.cameras.rectifier.as_ref()
    }

    pub(super) fn depth_scale(&self) -> f64 {
        self.depth_scale
    }

    pub(super) fn depth(&self, path: &Path, buffers: &mut FrameBuffers) -> Result<DepthImage, Error> {
        let malformed = |error: dymlm_core::Error| Error::malformed(path, error.to_string());
        let depth = std::mem::take(&mut buffers.depth);
        let (width, height, depth) = decode_depth(
            path,
            self.depth_scale,
            Some(&self.cameras.depth_camera),
            &mut buffers.decode,
            depth,
        )?;
        let depth = DepthImage::new(width, height, depth).map_err(malformed)?;
        self.cameras.pinhole_depth(depth, buffers).map_err(malformed)
    }

    pub(super) fn color(&self, path: &Path, buffers: &mut FrameBuffers) -> Result<ColorImage, Error> {
        let malformed = |error: dymlm_core::Error| Error::malformed(path, error.to_string());
        let color = std::mem::take(&mut buffers.color);
        let (width, height, color) =
            decode_color(path, Some(&self.cameras.camera), &mut buffers.decode, color)?;
        let color = ColorImage::new(width, height, color).map_err(malformed)?;
        self.cameras.pinhole_color(color, buffers).map_err(malformed)
    }
}

impl CameraPair {
    /// Converts a stored depth image to the pinhole camera of the frames.
    pub(crate) fn pinhole_depth(
        &self,
        mut depth: DepthImage,
        buffers: &mut FrameBuffers,
    ) -> Result<DepthImage, dymlm_core::Error> {
        if let Some(rectifier) = &self.depth_rectifier {
            let mut rectified = spare_depth(buffers)?;
            rectifier.rectify_depth(&depth, &mut rectified)?;
            buffers.spare_depth = Some(std::mem::replace(&mut depth, rectified));
        }
        if let Some(registration) = &self.registration {
            let mut registered = spare_depth(buffers)?;
            registration.register(&depth, &mut registered)?;
            buffers.spare_depth = Some(std::mem::replace(&mut depth, registered));
        }
        Ok(depth)
    }

    /// Converts a stored colour image to the pinhole camera of the frames.
    pub(crate) fn pinhole_color(
        &self,
        mut color: ColorImage,
        buffers: &mut FrameBuffers,
    ) -> Result<ColorImage, dymlm_core::Error> {
        if let Some(rectifier) = &self.rectifier {
            let spare = buffers.spare_color.take();
            let mut rectified = spare.map_or_else(|| ColorImage::new(1, 1, vec![[0; 3]]), Ok)?;
            rectifier.rectify_color(&color, &mut rectified)?;
            buffers.spare_color = Some(std::mem::replace(&mut color, rectified));
        }
        Ok(color)
    }
}

fn spare_depth(buffers: &mut FrameBuffers) -> Result<DepthImage, dymlm_core::Error> {
    buffers.spare_depth.take().map_or_else(|| DepthImage::empty(1, 1), Ok)
}
