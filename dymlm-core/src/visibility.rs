use crate::{DepthImage, PinholeCamera, Pose, SensorModel};

/// What a depth image says about a place.
///
/// After the ray verificator of Khronos (Schmid et al. 2024), with separate cases where a frame says nothing.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Visibility {
    /// The place is behind the camera or outside the image.
    OutOfView,
    /// The pixel has no reading.
    NoReading,
    /// Something nearer hides the place.
    Occluded,
    /// The reading is of the place.
    Present,
    /// The camera looks through the place at something farther: nothing is there.
    Absent,
}

impl Visibility {
    /// Compares a reading with the depth at which a place would be read, both in metres.
    ///
    /// ```
    /// use dymlm_core::Visibility;
    ///
    /// let of_reading = |reading| Visibility::of_reading(reading, 2.0, 0.05);
    /// assert_eq!(of_reading(1.9), Visibility::Occluded);
    /// assert_eq!(of_reading(2.04), Visibility::Present);
    /// assert_eq!(of_reading(2.1), Visibility::Absent);
    /// assert_eq!(of_reading(0.0), Visibility::NoReading);
    /// ```
    #[inline]
    #[must_use]
    pub fn of_reading(reading: f64, depth: f64, tolerance: f64) -> Self {
        if reading.is_nan() || reading <= 0.0 {
            Self::NoReading
        } else if reading < depth - tolerance {
            Self::Occluded
        } else if reading > depth + tolerance {
            Self::Absent
        } else {
            Self::Present
        }
    }
}

/// A depth image with its camera and sensor, to be asked about places.
#[derive(Debug, Clone, Copy)]
pub struct DepthView<'a> {
    camera: &'a PinholeCamera,
    depth: &'a DepthImage,
    sensor: &'a SensorModel,
}

/// The answer of a [`DepthView`]: where the place appears, what is read there, and what that says.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Sighting {
    /// What the reading says about the place.
    pub visibility: Visibility,
    /// Column and row of the pixel nearest to the place; `[0, 0]` when it is out of view.
    pub pixel: [usize; 2],
    /// The reading there, metres; 0 when there is none.
    pub reading: f32,
}

impl<'a> DepthView<'a> {
    /// A depth image of `camera`'s size, read by `sensor`.
    #[inline]
    #[must_use]
    pub fn new(camera: &'a PinholeCamera, depth: &'a DepthImage, sensor: &'a SensorModel) -> Self {
        Self { camera, depth, sensor }
    }

    /// The camera that took the depth image.
    #[inline]
    #[must_use]
    pub fn camera(&self) -> &'a PinholeCamera {
        self.camera
    }

    /// What the image says about a place in the camera's frame, metres, known to `place_sigma` metres (one
    /// standard deviation). A reading is of the place within [`SensorModel::tolerance`] at the place's depth.
    ///
    /// ```
    /// use dymlm_core::{DepthImage, DepthView, PinholeCamera, SensorModel, Visibility};
    ///
    /// let camera = PinholeCamera::new(64, 48, 60.0, 60.0, 31.5, 23.5)?;
    /// let depth = DepthImage::new(64, 48, vec![2.0; 64 * 48])?;
    /// let sensor = SensorModel::kinect();
    /// let view = DepthView::new(&camera, &depth, &sensor);
    /// let ahead = |z| view.look_at([0.0, 0.0, z], 0.01).visibility;
    /// assert_eq!([ahead(1.0), ahead(2.01), ahead(3.0)], [Visibility::Absent, Visibility::Present, Visibility::Occluded]);
    /// assert_eq!(ahead(-1.0), Visibility::OutOfView);
    /// # Ok::<(), dymlm_core::Error>(())
    /// ```
    #[inline]
    #[must_use]
    pub fn look_at(&self, place: [f64; 3], place_sigma: f64) -> Sighting {
        let Some(pixel) = self.camera.project(place).filter(|&pixel| self.camera.sees(pixel)) else {
            return Sighting { visibility: Visibility::OutOfView, pixel: [0, 0], reading: 0.0 };
        };
        let pixel = pixel.map(|c| c.round().max(0.0) as usize);
        let reading = self.depth.at(pixel[0], pixel[1]);
        let tolerance = self.sensor.tolerance(place[2] as f32, place_sigma);
        Sighting { visibility: Visibility::of_reading(reading.into(), place[2], tolerance), pixel, reading }
    }

    /// [`look_at`](Self::look_at) a place in the world.
    #[inline]
    #[must_use]
    pub fn look_at_world(&self, camera_from_world: &Pose, place: [f64; 3], place_sigma: f64) -> Sighting {
        self.look_at(camera_from_world.transform_point(place), place_sigma)
    }
}
