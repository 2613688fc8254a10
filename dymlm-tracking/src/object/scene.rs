use dymlm_core::{DepthImage, DepthView, PinholeCamera, SensorModel, Visibility};

use crate::ImagePyramid;

/// A frame as the parts of the tracker use it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scene<'a> {
    pub(super) camera: &'a PinholeCamera,
    pub(super) pyramid: &'a ImagePyramid,
    pub(super) depth: &'a DepthImage,
    pub(super) sensor: &'a SensorModel,
}

impl Scene<'_> {
    /// The reading at the pixel nearest to an image point, metres; `None` without a reading in the sensor's
    /// range.
    pub(super) fn reading_at(&self, pixel: [f32; 2]) -> Option<f64> {
        let [u, v] = pixel.map(f32::round);
        if !(u >= 0.0 && v >= 0.0) {
            return None;
        }
        let reading = self.depth.at(u as usize, v as usize);
        self.sensor.is_used(reading).then(|| reading.into())
    }

    /// What the depth image says about a place in the camera's frame that is known to `sigma` metres.
    pub(super) fn look_at(&self, place: [f64; 3], sigma: f64) -> dymlm_core::Sighting {
        DepthView::new(self.camera, self.depth, self.sensor).look_at(place, sigma)
    }

    /// Whether a place is occluded or outside the image.
    pub(super) fn is_occluded(&self, place: [f64; 3], sigma: f64) -> bool {
        matches!(self.look_at(place, sigma).visibility, Visibility::Occluded | Visibility::OutOfView)
    }

    /// Whether there is a reading at the pixel of a place.
    pub(super) fn has_depth_at(&self, place: [f64; 3]) -> bool {
        self.camera.project(place).is_some_and(|pixel| self.reading_at(pixel.map(|c| c as f32)).is_some())
    }

    /// Standard deviation of a reading at a depth, metres.
    pub(super) fn sigma(&self, depth: f64) -> f64 {
        self.sensor.sigma(depth as f32).into()
    }
}
