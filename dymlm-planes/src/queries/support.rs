use crate::linear_algebra::foot_on;
use crate::plane_map::{MapPlane, PlaneMap};

impl PlaneMap {
    /// The planes that something at `point` may rest on or lean against: those no more than `reach` metres
    /// from it whose patch holds the point's foot, to a voxel. In the order of their ids. O(planes).
    pub fn supports_near(&self, point: [f64; 3], reach: f64) -> impl Iterator<Item = &MapPlane> {
        self.iter().filter(move |plane| {
            let own = plane.plane();
            own.signed_distance(point).abs() <= reach && plane.holds(foot_on(&own, point))
        })
    }
}
