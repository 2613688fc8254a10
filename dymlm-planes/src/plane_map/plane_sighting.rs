use dymlm_core::{FrameId, PlaneId, Pose};

use super::map::PlaneMap;

/// What a key frame has seen of a confirmed plane: the moments of its inliers, in the camera's frame.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PlaneSighting {
    /// The key frame, by its number among those inserted.
    pub key_frame: FrameId,
    /// From where it was seen.
    pub world_from_camera: Pose,
    /// The plane.
    pub plane: PlaneId,
    /// Sum of the inliers' weights; a reading at 0.4 m weighs 1.
    pub weight: f64,
    /// Weighted mean of the inliers, metres.
    pub centroid: [f64; 3],
    /// Weighted covariance of the inliers, square metres, as xx, xy, xz, yy, yz, zz.
    pub covariance: [f64; 6],
}

impl PlaneMap {
    /// What each key frame has seen of the confirmed planes, in the order of the key frames: what poses can be
    /// refined by. Not of planes that have moved since, with an object that was carried. O(key frames).
    pub fn key_frame_sightings(&self) -> impl Iterator<Item = PlaneSighting> + '_ {
        self.key_frames.iter().flat_map(move |(&key_frame, seen)| {
            seen.standing_shares().filter_map(move |share| {
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
            })
        })
    }
}
