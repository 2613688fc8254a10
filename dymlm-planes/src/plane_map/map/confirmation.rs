use dymlm_core::Pose;
use dymlm_core::vector3::{difference, dot, norm};

use super::super::map_plane::MapPlane;
use super::{KeyFrame, PlaneMap};
use crate::detector::patch_range;

/// Cosine of the angle from its optical axis within which a key frame looks at a place: 25 degrees, the inner
/// half of a Kinect's view.
const COS_VIEW: f64 = 0.906_308;

/// Which planes are believed.
impl PlaneMap {
    /// Judges the planes that reach into a box (lowest and highest corner, metres, world): one that is gone is
    /// not believed until it is judged anew.
    pub fn judge(&mut self, region: [[f64; 3]; 2], is_gone: impl Fn(&MapPlane) -> bool) {
        let mut planes = std::mem::take(&mut self.planes);
        for plane in planes.iter_mut().filter(|plane| plane.is_gone || plane.bounds.overlaps(region)) {
            plane.is_gone = is_gone(plane);
            plane.is_confirmed = self.is_believed(plane);
        }
        self.planes = planes;
    }

    /// Judges all planes after a key frame: those that it touched anew, for the others it counts as a look at
    /// most.
    pub(super) fn confirm_after(&mut self, world_from_camera: &Pose, is_touched: impl Fn(&MapPlane) -> bool) {
        let mut planes = std::mem::take(&mut self.planes);
        for plane in &mut planes {
            if is_touched(plane) {
                self.recount(plane);
            } else if self.counts_looks(plane) && self.looks_at(world_from_camera, plane) {
                plane.looks += 1;
            }
            plane.is_confirmed = self.is_believed(plane);
        }
        self.planes = planes;
    }

    /// Judges all planes anew. O(planes x key frames).
    pub(super) fn confirm_all(&mut self) {
        let mut planes = std::mem::take(&mut self.planes);
        for plane in &mut planes {
            self.recount(plane);
            plane.is_confirmed = self.is_believed(plane);
        }
        self.planes = planes;
    }

    fn recount(&self, plane: &mut MapPlane) {
        // Before it was seen first, it may not have stood there.
        let looks = |key_frame: &&KeyFrame| {
            key_frame.timestamp >= plane.first_seen() && self.looks_at(&key_frame.world_from_camera, plane)
        };
        plane.looks =
            if self.counts_looks(plane) { self.key_frames.values().filter(looks).count() } else { 0 };
    }

    /// Whether it matters how many have looked at a plane: when enough have seen it.
    fn counts_looks(&self, plane: &MapPlane) -> bool {
        plane.observations() >= self.config.min_observations
    }

    fn is_believed(&self, plane: &MapPlane) -> bool {
        let seen = plane.observations();
        !plane.is_gone
            && seen >= self.config.min_observations
            && f64::from(seen) >= self.config.min_observation_share * plane.looks as f64
    }

    /// Whether a camera looks at a plane's centroid from before it, and is near enough to draw a patch there.
    /// What stands in the way is not asked.
    fn looks_at(&self, world_from_camera: &Pose, plane: &MapPlane) -> bool {
        let ray = difference(plane.centroid, world_from_camera.translation());
        let depth = dot(ray, world_from_camera.rotate([0.0, 0.0, 1.0]));
        (depth > 0.0 && depth <= patch_range(&self.sensor).into() && depth >= COS_VIEW * norm(ray))
            && dot(ray, plane.plane.normal()) < 0.0
    }
}
