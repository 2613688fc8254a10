use dymlm_core::{DepthImage, PinholeCamera, Pose, axial_noise};

use super::ObjectModel;
use crate::PoseObservation;

/// Readings used at most; more tell nothing new.
const MOST_READINGS: usize = 250;
/// Points seen more obliquely than this cosine lie on the silhouette, where readings err.
const LEAST_COSINE: f64 = 0.25;

/// What the depth image says about the model's surface at a pose.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(super) struct SurfaceView {
    /// Points whose reading lies near them.
    pub(super) seen: usize,
    /// Points behind something nearer.
    pub(super) hidden: usize,
    /// Points that the camera looks through.
    pub(super) absent: usize,
}

impl SurfaceView {
    /// Of places in the camera's frame that face it.
    pub(super) fn of_places(
        places: impl Iterator<Item = [f64; 3]>,
        camera: &PinholeCamera,
        depth: &DepthImage,
        gate: f64,
    ) -> Self {
        let mut view = Self::default();
        for place in places {
            view.compare(place, camera, depth, gate);
        }
        view
    }

    /// Compares a place with the reading there; gives the reading's, when it is the same.
    fn compare(
        &mut self,
        place: [f64; 3],
        camera: &PinholeCamera,
        depth: &DepthImage,
        gate: f64,
    ) -> Option<[f64; 3]> {
        let pixel = camera.project(place).filter(|&pixel| camera.sees(pixel))?;
        let [u, v] = pixel.map(|c| c.round().max(0.0));
        let reading = depth.at(u as usize, v as usize);
        if reading <= 0.0 {
            return None;
        }
        let reach = gate + 3.0 * f64::from(axial_noise(reading));
        let beyond = f64::from(reading) - place[2];
        if beyond < -reach {
            self.hidden += 1;
        } else if beyond > reach {
            self.absent += 1;
        } else {
            self.seen += 1;
            return Some(camera.back_project([u, v], reading.into()));
        }
        None
    }

    /// Share of the points with a reading that something nearer hides.
    pub(super) fn hidden_share(&self) -> f64 {
        self.hidden as f64 / (self.seen + self.hidden + self.absent).max(1) as f64
    }

    /// Share of the points with a reading that are there.
    pub(super) fn seen_share(&self) -> f64 {
        self.seen as f64 / (self.seen + self.hidden + self.absent).max(1) as f64
    }

    /// Whether there is enough depth to tell anything.
    pub(super) fn tells(&self) -> bool {
        self.seen + self.hidden + self.absent >= 20
    }
}

/// Compares the model's surface at a pose with the readings (projective association), and adds what lies within `gate`
/// metres as point-to-plane observations. `sigma`: standard deviation of a reading from the model by its depth.
pub(super) fn observe_surface(
    model: &ObjectModel,
    camera: &PinholeCamera,
    depth: &DepthImage,
    camera_from_object: &Pose,
    gate: f64,
    sigma: impl Fn(f32) -> f64,
    observations: &mut Vec<PoseObservation>,
) -> SurfaceView {
    let mut view = SurfaceView::default();
    let facing = model.facing(camera_from_object, LEAST_COSINE).count();
    let stride = facing.div_ceil(MOST_READINGS).max(1);
    for (point, place) in model.facing(camera_from_object, LEAST_COSINE).step_by(stride) {
        if let Some(measured) = view.compare(place, camera, depth, gate) {
            observations.push(PoseObservation::Surface {
                point: point.position,
                normal: point.normal,
                measured,
                sigma: sigma(measured[2] as f32),
            });
        }
    }
    view
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tells_seen_from_hidden_from_absent() {
        let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5).unwrap();
        let model = ObjectModel::cuboid([0.4, 0.4, 0.1]).unwrap();
        let pose = Pose::new([0.0, 0.0, 1.05], [0.0, 0.0, 0.0, 1.0]).unwrap();
        // Its face at 1 m on the right half, a hand on the upper left, nothing on the lower left.
        let data = (0..160 * 120)
            .map(|i| match (i % 160 < 80, i / 160 < 60) {
                (false, _) => 1.0,
                (true, true) => 0.6,
                (true, false) => 2.0,
            })
            .collect();
        let depth = DepthImage::new(160, 120, data).unwrap();
        let mut observations = Vec::new();
        let view = observe_surface(&model, &camera, &depth, &pose, 0.02, f64::from, &mut observations);
        assert!(view.tells() && observations.len() == view.seen);
        assert!((view.hidden_share() - 0.25).abs() < 0.04, "{view:?}");
        assert!((view.seen_share() - 0.5).abs() < 0.04, "{view:?}");
    }
}
