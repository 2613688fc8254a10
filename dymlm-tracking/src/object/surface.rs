use dymlm_core::{Pose, Visibility};

use super::model::ObjectModel;
use super::scene::Scene;
use crate::PoseObservation;

/// Largest number of readings used; more add nothing.
const MOST_READINGS: usize = 250;
/// Factor on the noise of a surface's readings as observations of its pose, since errors of neighbouring
/// readings are correlated. With 3 the surface outweighs the points, and a bottle leans by 1.4 degrees
/// instead of 1; higher values waste the information in the depth.
const LIKE_READINGS: f64 = 4.0;
/// Fewer readings say nothing about a surface.
const ENOUGH: usize = 20;

/// Numbers of places on the object's surface that a depth image shows to be present, occluded and absent.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct SurfaceReadings {
    pub(super) present: usize,
    occluded: usize,
    absent: usize,
}

impl SurfaceReadings {
    /// For places in the camera's frame that face the camera and are known to `sigma` metres.
    pub(super) fn of_places(places: impl Iterator<Item = [f64; 3]>, scene: Scene<'_>, sigma: f64) -> Self {
        let mut readings = Self::default();
        for place in places {
            readings.count(scene.look_at(place, sigma).visibility);
        }
        readings
    }

    fn count(&mut self, visibility: Visibility) {
        match visibility {
            Visibility::Present => self.present += 1,
            Visibility::Occluded => self.occluded += 1,
            Visibility::Absent => self.absent += 1,
            Visibility::OutOfView | Visibility::NoReading => {}
        }
    }

    fn total(&self) -> usize {
        self.present + self.occluded + self.absent
    }

    /// Share of the places with a reading that are occluded; 0 without readings.
    pub(super) fn occluded_share(&self) -> f64 {
        self.occluded as f64 / self.total().max(1) as f64
    }

    /// Whether most of the places with a reading are occluded.
    pub(super) fn is_mostly_occluded(&self) -> bool {
        2 * self.occluded > self.total()
    }

    /// Whether most of the places with a reading are present.
    pub(super) fn is_mostly_present(&self) -> bool {
        2 * self.present > self.total()
    }

    /// Whether there are enough readings for a judgement.
    pub(super) fn has_enough(&self) -> bool {
        self.total() >= ENOUGH
    }
}

/// Compares the model's surface at a pose with the readings (projective association), and adds the readings
/// of the surface as point-to-plane observations. `model_sigma`: standard deviation of the model's surface
/// from the object's, metres.
pub(super) fn observe_surface(
    model: &ObjectModel,
    scene: Scene<'_>,
    camera_from_object: &Pose,
    model_sigma: f64,
    observations: &mut Vec<PoseObservation>,
) -> SurfaceReadings {
    let mut readings = SurfaceReadings::default();
    let facing = model.facing(camera_from_object).count();
    let stride = facing.div_ceil(MOST_READINGS).max(1);
    for (point, place) in model.facing(camera_from_object).step_by(stride) {
        let seen = scene.look_at(place, model_sigma);
        readings.count(seen.visibility);
        if seen.visibility == Visibility::Present {
            let depth = f64::from(seen.reading);
            observations.push(PoseObservation::Surface {
                point: point.position,
                normal: point.normal,
                measured: scene.camera.back_project(seen.pixel.map(|c| c as f64), depth),
                sigma: (LIKE_READINGS * scene.sigma(depth)).hypot(model_sigma),
            });
        }
    }
    readings
}

#[cfg(test)]
mod tests {
    use dymlm_core::{DepthImage, PinholeCamera, SensorModel};

    use super::*;
    use crate::ImagePyramid;

    #[test]
    fn places_are_present_occluded_or_absent() {
        let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5).unwrap();
        let model = ObjectModel::cuboid([0.4, 0.4, 0.1]).unwrap();
        let pose = Pose::new([0.0, 0.0, 1.05], [0.0, 0.0, 0.0, 1.0]).unwrap();
        // The face at 1 m on the right half, a hand on the upper left, background on the lower left.
        let data = (0..160 * 120)
            .map(|i| match (i % 160 < 80, i / 160 < 60) {
                (false, _) => 1.0,
                (true, true) => 0.6,
                (true, false) => 2.0,
            })
            .collect();
        let depth = DepthImage::new(160, 120, data).unwrap();
        let scene = Scene {
            camera: &camera,
            pyramid: &ImagePyramid::empty(0),
            depth: &depth,
            sensor: &SensorModel::kinect(),
        };
        let mut observations = Vec::new();
        let readings = observe_surface(&model, scene, &pose, 0.008, &mut observations);
        assert!(readings.has_enough() && observations.len() == readings.present);
        assert!((readings.occluded_share() - 0.25).abs() < 0.04, "{readings:?}");
        assert!((readings.present as f64 / readings.total() as f64 - 0.5).abs() < 0.04, "{readings:?}");
        assert!(!readings.is_mostly_occluded());
    }
}
