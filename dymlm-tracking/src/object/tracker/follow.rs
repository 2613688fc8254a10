use dymlm_core::{Frame, Pose, axial_noise};

use super::super::recovery::Place;
use super::super::state::ObjectState;
use super::super::view::Sighting;
use super::fit::Fit;
use super::readings::reading_at;
use super::search::placed;
use super::{ObjectTracker, Scratch};
use crate::pose::PosePrior;
use crate::{FlowStatus, PoseObservation};

/// From one frame into the next.
impl ObjectTracker {
    /// From the last frame: by the flow of its points, or by the motion alone.
    pub(super) fn follow(
        &mut self,
        frame: &Frame,
        predicted: &Pose,
        prior: Option<&PosePrior>,
        window_center: Option<[f32; 2]>,
    ) -> Option<Fit> {
        if self.state == ObjectState::Lost {
            return None;
        }
        let camera = frame.camera();
        let guess = window_center.and_then(|center| {
            placed(camera, predicted, Place { center, depth: predicted.translation()[2] })
        });
        for start in [Some(*predicted), guess].into_iter().flatten() {
            if let Some(flowed) = self.flow_pose(frame, &start, prior)
                && let Some(fit) = self.fit(frame, &flowed, prior)
            {
                return Some(fit);
            }
        }
        let coarse = [Some(*predicted), guess];
        coarse.into_iter().flatten().find_map(|pose| self.fit(frame, &pose, prior))
    }

    /// The pose that the flow of the last frame's points agrees on.
    fn flow_pose(&mut self, frame: &Frame, start: &Pose, prior: Option<&PosePrior>) -> Option<Pose> {
        let camera = frame.camera();
        let Scratch { from, guesses, found, .. } = &mut self.scratch;
        from.clear();
        guesses.clear();
        for track in &self.tracks {
            from.push(track.pixel);
            let expected = camera.project(start.transform_point(track.position));
            guesses.push(expected.map_or(track.pixel, |pixel| pixel.map(|c| c as f32)));
        }
        self.flow.track_into(&self.last, &self.next, from, guesses, found);
        let tracked = self.tracks.iter().zip(&self.scratch.found);
        let tracked = tracked.filter(|(_, found)| found.status == FlowStatus::Tracked);
        let sightings: Vec<Sighting> =
            tracked.map(|(track, found)| Sighting { pixel: found.point, ..*track }).collect();
        self.agree(frame, &sightings, prior)
    }

    /// The pose that points agree on: in space where there is depth, else in the image.
    pub(super) fn agree(
        &self,
        frame: &Frame,
        sightings: &[Sighting],
        prior: Option<&PosePrior>,
    ) -> Option<Pose> {
        let camera = frame.camera();
        let (mut in_object, mut in_camera) = (Vec::new(), Vec::new());
        for sighting in sightings {
            if let Some(reading) = reading_at(frame, sighting.pixel) {
                in_object.push(sighting.position);
                in_camera.push(camera.back_project(sighting.pixel.map(f64::from), reading));
            }
        }
        let in_space =
            (2 * in_object.len() >= sightings.len()).then(|| self.ransac.align(&in_object, &in_camera));
        let consensus = in_space.flatten().or_else(|| {
            let positions: Vec<_> = sightings.iter().map(|sighting| sighting.position).collect();
            let pixels: Vec<_> = sightings.iter().map(|sighting| sighting.pixel.map(f64::from)).collect();
            self.ransac.pnp(camera, &positions, &pixels)
        })?;
        // Readings are noisy, pixels are not: both together.
        let mut observations = Vec::with_capacity(2 * sightings.len());
        for sighting in sightings {
            self.observe(frame, sighting, &consensus.pose, 4.0, &mut observations);
        }
        let refined = self.refiner.refine_with(camera, &consensus.pose, &observations, prior)?;
        Some(refined.camera_from_body)
    }

    /// Adds a point's pixel and its depth, when that is near enough to be its own.
    pub(super) fn observe(
        &self,
        frame: &Frame,
        sighting: &Sighting,
        pose: &Pose,
        sigma_factor: f64,
        observations: &mut Vec<PoseObservation>,
    ) {
        let point = sighting.position;
        let sigma = sighting.spread.hypot(sigma_factor * sighting.blur * self.config.pixel_sigma);
        observations.push(PoseObservation::Pixel { point, pixel: sighting.pixel.map(f64::from), sigma });
        if let Some(depth) = reading_at(frame, sighting.pixel) {
            let expected = pose.transform_point(point)[2];
            if (depth - expected).abs() < 2.0 * self.config.surface_gate {
                let sigma = self.config.depth_sigma_factor * f64::from(axial_noise(depth as f32));
                observations.push(PoseObservation::Depth { point, depth, sigma });
            }
        }
    }
}
