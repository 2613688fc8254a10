use dymlm_core::Pose;
use dymlm_core::vector3::{difference, dot, norm};

use super::super::map_plane::MapPlane;
use super::{KeyFrame, PlaneMap};
use crate::detector::patch_range;
use crate::linear_algebra::foot_on;

/// Cosine of the angle from its optical axis within which a key frame looks at a place: 25 degrees, the inner
/// half of a Kinect's view.
const COS_VIEW: f64 = 0.906_308;

/// A plane is a ghost when this share of its inliers is free space.
const GHOST_SHARE: f64 = 0.5;

/// Which planes are believed.
impl PlaneMap {
    /// Judges the planes that reach into a box (lowest and highest corner, metres, world): a plane more than
    /// half of whose inliers are free space, of those of which something is known, is not believed until it
    /// is judged anew. `is_free` tells whether a place in which something was read is free now; `None` where
    /// nothing is known.
    pub fn judge(&mut self, region: [[f64; 3]; 2], is_free: impl Fn([f64; 3]) -> Option<bool>) {
        let voxel_size = self.config.voxel_size;
        let mut planes = std::mem::take(&mut self.planes);
        for plane in planes.iter_mut().filter(|plane| plane.is_ghost || plane.bounds.overlaps(region)) {
            let voxels = plane.patch.voxels().iter();
            let places = voxels.map(|voxel| foot_on(&plane.plane, voxel.center(voxel_size)));
            let (mut known, mut free) = (0_u32, 0_u32);
            for is_free in places.filter_map(&is_free) {
                known += 1;
                free += u32::from(is_free);
            }
            plane.is_ghost = f64::from(free) > GHOST_SHARE * f64::from(known);
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
        !plane.is_ghost
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
