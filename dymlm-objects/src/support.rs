use std::collections::BTreeSet;

use dymlm_core::{Plane, PlaneId};

/// A plane that things may stand on.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SupportPlane {
    /// Id of the plane in the map; `None` for a level patch around a thing that is not a plane of the map.
    pub id: Option<PlaneId>,
    /// The plane in the world; its normal points to the side that cameras have seen.
    pub plane: Plane,
}

impl SupportPlane {
    /// A plane of the map.
    pub fn new(id: PlaneId, plane: Plane) -> Self {
        Self { id: Some(id), plane }
    }

    /// A level patch that is not a plane of the map.
    pub(crate) fn local(plane: Plane) -> Self {
        Self { id: None, plane }
    }
}

/// Drops repeated planes and keeps the order in which they were found: ids are names, and no result may
/// depend on their order.
pub(crate) fn drop_repeated(found: &mut Vec<SupportPlane>) {
    let mut known = BTreeSet::new();
    found.retain(|plane| known.insert(plane.id));
}

/// Finite planes of a map, which can be searched near a point. A closure with the arguments of
/// [`near`](Self::near) implements it.
///
/// ```
/// use dymlm_core::{Plane, PlaneId};
/// use dymlm_objects::{SupportPlane, SupportingPlanes};
///
/// // A floor without end.
/// let floor = SupportPlane::new(PlaneId::new(0), Plane::new([0.0, 0.0, 1.0], 0.0)?);
/// let planes = |point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>| {
///     if floor.plane.signed_distance(point).abs() <= reach {
///         found.push(floor);
///     }
/// };
/// let mut found = Vec::new();
/// planes.near([1.0, 2.0, 0.05], 0.1, &mut found);
/// assert_eq!(found, [floor]);
/// # Ok::<(), dymlm_core::Error>(())
/// ```
pub trait SupportingPlanes {
    /// Adds to `found` the planes whose finite patch lies within `reach` metres of a point (world). They may
    /// include walls and ceilings. Where nothing else decides between planes, the first one in `found`
    /// counts; so results stay the same if a map built again gives its planes in the same order.
    fn near(&self, point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>);

    /// The present id of a plane on which objects stand: after a merge, that of the plane into which it was
    /// merged.
    fn current_id(&self, id: PlaneId) -> PlaneId {
        id
    }

    /// A number that changes whenever a present id may have changed, so that ids are not looked up in each
    /// frame; `None` when this is not known.
    fn ids_revision(&self) -> Option<u64> {
        None
    }
}

impl<F: Fn([f64; 3], f64, &mut Vec<SupportPlane>)> SupportingPlanes for F {
    fn near(&self, point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>) {
        self(point, reach, found);
    }
}

/// A map without planes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NoPlanes;

impl SupportingPlanes for NoPlanes {
    fn near(&self, _point: [f64; 3], _reach: f64, _found: &mut Vec<SupportPlane>) {}
}
