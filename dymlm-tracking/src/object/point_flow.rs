use dymlm_core::Pose;

use super::pixel_lengths::{HALVINGS, PixelLengths};
use super::scene::Scene;
use super::view::PointMatch;
use crate::{Error, FlowConfig, FlowPoint, FlowStatus, ImagePyramid, Lighting, OpticalFlow};

/// Tracks points from one frame to the next by optical flow.
#[derive(Debug, Clone)]
pub(super) struct PointFlow {
    flow: OpticalFlow,
    from: Vec<[f32; 2]>,
    guesses: Vec<[f32; 2]>,
    found: Vec<FlowPoint>,
}

impl PointFlow {
    pub(super) fn new(lengths: &PixelLengths) -> Result<Self, Error> {
        let config = FlowConfig {
            window_radius: lengths.flow_radius,
            halvings: HALVINGS,
            max_forward_backward: Some(1.0),
            lighting: Lighting::Affine,
        };
        let (from, guesses, found) = (Vec::new(), Vec::new(), Vec::new());
        Ok(Self { flow: OpticalFlow::new(&config)?, from, guesses, found })
    }

    /// The points of the last frame that are found in the scene, where the object is near `start`. Points
    /// that are not found are left out.
    pub(super) fn follow(
        &mut self,
        last: &ImagePyramid,
        scene: Scene<'_>,
        tracks: &[PointMatch],
        start: &Pose,
    ) -> Vec<PointMatch> {
        self.from.clear();
        self.guesses.clear();
        for track in tracks {
            self.from.push(track.pixel);
            let expected = scene.camera.project(start.transform_point(track.position));
            self.guesses.push(expected.map_or(track.pixel, |pixel| pixel.map(|c| c as f32)));
        }
        self.flow.track_into(last, scene.pyramid, &self.from, &self.guesses, &mut self.found);
        let found = tracks.iter().zip(&self.found);
        let tracked = found.filter(|(_, found)| found.status == FlowStatus::Tracked);
        tracked.map(|(track, found)| PointMatch { pixel: found.point, ..*track }).collect()
    }
}
