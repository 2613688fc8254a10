use dymlm_core::PlaneId;
use dymlm_core::vector3::{along, bounds, difference, dot, norm, unit};

use super::SurfaceConfig;
use crate::patches::VoxelBox;
use crate::plane_map::{MapPlane, PlaneMap};

/// A level plane under a point, whether it was observed right there or only nearby.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct LevelUnder {
    /// The plane.
    pub plane: PlaneId,
    /// Distance from the point straight down to the plane, metres.
    pub distance: f64,
    /// The point of the plane straight below, metres, world.
    pub point: [f64; 3],
    /// The inlier of the plane that is nearest to `point`, projected onto the plane; equals `point` where the
    /// plane was observed.
    pub nearest_inlier: [f64; 3],
    /// Distance between `point` and `nearest_inlier`, metres: 0 where the plane was observed, to a voxel,
    /// otherwise the length by which the plane is extended.
    pub extended_by: f64,
}

impl PlaneMap {
    /// The level planes that face up and lie under a point, within `max_distance` metres against `up`, sorted
    /// by distance. They count if they have inliers near the place below, because a forward camera never sees
    /// what it stands on: within `reach` metres, and no farther than the plane is large (the root of its
    /// area). Planes are level within the default angle of [`SurfaceConfig`]. Empty for an `up` without
    /// length and for a point that is not finite.
    ///
    /// What lies between the inliers and the point is not checked. O(planes near, and their voxels within
    /// reach).
    pub fn levels_under(
        &self,
        point: [f64; 3],
        up: [f64; 3],
        max_distance: f64,
        reach: f64,
    ) -> Vec<LevelUnder> {
        let (Some(up), true) = (unit(up), point.iter().all(|c| c.is_finite())) else { return Vec::new() };
        if !(max_distance >= 0.0 && reach >= 0.0) {
            return Vec::new();
        }
        // The map has no plane beyond its farthest inlier and the reach.
        let reach = reach.min(self.farthest_from(point));
        let max_distance = max_distance.min(self.farthest_from(point) + reach);
        let column = bounds([point, along(point, -max_distance, up)]);
        let around = [column[0].map(|c| c - reach), column[1].map(|c| c + reach)];
        let near = self.confirmed_near(VoxelBox::around(around, self.config().voxel_size).grown(1));
        let least_cosine = SurfaceConfig::default().max_tilt_deg.to_radians().cos();
        let level = near.filter(|plane| dot(plane.plane().normal(), up) >= least_cosine);
        let under = level.filter_map(|plane| level_under(plane, point, up, max_distance, reach));
        let mut found: Vec<LevelUnder> = under.collect();
        found.sort_by(|a, b| a.distance.total_cmp(&b.distance));
        found
    }
}

fn level_under(
    plane: &MapPlane,
    point: [f64; 3],
    up: [f64; 3],
    max_distance: f64,
    reach: f64,
) -> Option<LevelUnder> {
    let distance = plane.plane().signed_distance(point) / dot(plane.plane().normal(), up);
    if !(0.0..=max_distance).contains(&distance) {
        return None;
    }
    let foot = along(point, -distance, up);
    // A plane is extended no farther than it is large, because its tilt is no better known, and a chair's
    // seat is not a floor.
    let reach = reach.min(plane.size());
    let nearest_inlier = if plane.holds(foot) { foot } else { plane.nearest_inlier(foot, reach)? };
    let extended_by = norm(difference(nearest_inlier, foot));
    Some(LevelUnder { plane: plane.id(), distance, point: foot, nearest_inlier, extended_by })
}
