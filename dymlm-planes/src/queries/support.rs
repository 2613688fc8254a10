use crate::linear_algebra::foot_on;
use crate::patches::VoxelBox;
use crate::plane_map::{MapPlane, PlaneMap};

impl PlaneMap {
    /// The confirmed planes on which a thing at `point` may rest or against which it may lean: those at most
    /// `reach` metres away whose patch holds the point's projection, to a voxel, and which one key frame more
    /// has seen than [`min_observations`](crate::PlaneMapConfig::min_observations) asks for. The upper side of
    /// something flat, a keyboard or a book, is none: it passes for a part of the plane on which it lies. In the
    /// order in which the planes came into the map. O(planes near, squared).
    pub fn supports_near(&self, point: [f64; 3], reach: f64) -> impl Iterator<Item = &MapPlane> {
        let least = self.config().lasting_observations();
        let around = [-reach, reach].map(|side| point.map(|c| c + side));
        let around = VoxelBox::around(around, self.config().voxel_size).grown(1);
        let near: Vec<&MapPlane> = self.confirmed_near(around).collect();
        (0..near.len()).filter_map(move |index| {
            let plane = near[index];
            let own = plane.plane();
            let is_support = plane.observations() >= least
                && own.signed_distance(point).abs() <= reach
                && plane.holds(foot_on(&own, point))
                && !near.iter().any(|other| self.lies_flat_on(plane, other));
            is_support.then_some(plane)
        })
    }
}
