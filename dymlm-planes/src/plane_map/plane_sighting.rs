use dymlm_core::{FrameId, PlaneId, Pose};

use super::map::PlaneMap;

/// What a key frame has seen of a confirmed plane: the moments of its inliers, in the camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PlaneSighting {
    /// The key frame.
    pub key_frame: FrameId,
    /// The key frame's pose.
    pub world_from_camera: Pose,
    /// The plane.
    pub plane: PlaneId,
    /// Sum of the inliers' weights; a reading with the sensor's least noise (a Kinect's at 0.4 m) has weight
    /// 1. Of a long rest at one place less and less of it counts in the plane.
    pub weight: f64,
    /// Weighted mean of the inliers, metres.
    pub centroid: [f64; 3],
    /// Weighted covariance of the inliers, square metres, as xx, xy, xz, yy, yz, zz.
    pub covariance: [f64; 6],
}

impl PlaneMap {
    /// What each key frame has seen of the confirmed planes, in the order of the key frames; poses can be
    /// refined with it. Planes that were moved since with a carried object are left out. O(key frames).
    pub fn key_frame_sightings(&self) -> impl Iterator<Item = PlaneSighting> + '_ {
        self.key_frames.iter().flat_map(move |(key_frame, seen)| {
            let sightings = seen.standing_shares().filter_map(|share| {
                let plane = self.planes.get(&self.resolve(share.plane))?;
                let (weight, centroid, covariance) = share.own_moments();
                plane.is_confirmed.then_some(PlaneSighting {
                    key_frame,
                    world_from_camera: seen.world_from_camera,
                    plane: plane.id,
                    weight,
                    centroid,
                    covariance,
                })
            });
            sightings.collect::<Vec<_>>()
        })
    }
}
