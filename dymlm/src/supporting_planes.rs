use dymlm_objects::{SupportPlane, SupportingPlanes};
use dymlm_planes::PlaneMap;

/// The planes of the map as those that objects stand on.
pub(crate) struct MappedPlanes<'a>(pub(crate) &'a PlaneMap);

impl SupportingPlanes for MappedPlanes<'_> {
    fn near(&self, point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>) {
        for plane in self.0.planes() {
            let distance = plane.plane().signed_distance(point);
            if distance.abs() > reach {
                continue;
            }
            let normal = plane.plane().normal();
            let foot = std::array::from_fn(|axis| point[axis] - distance * normal[axis]);
            if plane.holds(foot) {
                found.push(SupportPlane::new(plane.id(), plane.plane()));
            }
        }
    }
}
