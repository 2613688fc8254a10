use dymlm_core::PlaneId;
use dymlm_objects::{SupportPlane, SupportingPlanes};
use dymlm_planes::PlaneMap;

/// The planes of the map, as planes that objects may stand on.
pub(crate) struct MappedPlanes<'a>(pub(crate) &'a PlaneMap);

impl SupportingPlanes for MappedPlanes<'_> {
    fn near(&self, point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>) {
        let supports = self.0.supports_near(point, reach);
        found.extend(supports.map(|plane| SupportPlane::new(plane.id(), plane.plane())));
    }

    fn current_id(&self, id: PlaneId) -> PlaneId {
        self.0.current_id(id).unwrap_or(id)
    }

    fn ids_revision(&self) -> Option<u64> {
        Some(self.0.ids_revision())
    }
}
