use dymlm_core::Pose;
use dymlm_core::vector3::{difference, dot, norm};

use super::super::map_plane::MapPlane;
use super::{KeyFrame, PlaneMap};

/// Planes that so many key frames have seen are confirmed, however many have looked past them.
const SURE_OBSERVATIONS: u32 = 20;
/// Cosine of the angle from its optical axis within which a key frame looks at a place: 25 degrees, the inner
/// half of a Kinect's view.
const COS_VIEW: f64 = 0.906_308;

/// Which planes are believed.
impl PlaneMap {
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
        let looks = |key_frame: &&KeyFrame| self.looks_at(&key_frame.world_from_camera, plane);
        plane.looks =
            if self.counts_looks(plane) { self.key_frames.values().filter(looks).count() } else { 0 };
    }

    /// Whether it matters how many have looked at a plane: when neither too few nor enough have seen it.
    fn counts_looks(&self, plane: &MapPlane) -> bool {
        (self.config.min_observations..SURE_OBSERVATIONS).contains(&plane.observations())
    }

    fn is_believed(&self, plane: &MapPlane) -> bool {
        let seen = plane.observations();
        let often = || f64::from(seen) >= self.config.min_observation_share * plane.looks as f64;
        seen >= self.config.min_observations && (seen >= SURE_OBSERVATIONS || often())
    }

    /// Whether a camera looks at a plane's centroid from before it. What stands in the way is not asked.
    fn looks_at(&self, world_from_camera: &Pose, plane: &MapPlane) -> bool {
        let ray = difference(plane.centroid, world_from_camera.translation());
        let depth = dot(ray, world_from_camera.rotate([0.0, 0.0, 1.0]));
        (depth > 0.0 && depth <= self.sensor.max_depth.into() && depth >= COS_VIEW * norm(ray))
            && dot(ray, plane.plane.normal()) < 0.0
    }
}
