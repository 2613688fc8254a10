use std::collections::BTreeSet;

use dymlm_core::{Plane, PlaneId};

/// A plane that things may stand on.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SupportPlane {
    /// The plane of the map that it is; `None` for a level patch around a thing that is no plane of the map.
    pub id: Option<PlaneId>,
    /// The plane in the world; its normal points to the side that cameras have seen.
    pub plane: Plane,
}

impl SupportPlane {
    /// A plane of the map.
    pub fn new(id: PlaneId, plane: Plane) -> Self {
        Self { id: Some(id), plane }
    }

    /// A level patch that is no plane of the map.
    pub(crate) fn local(plane: Plane) -> Self {
        Self { id: None, plane }
    }
}

/// Keeps planes that were found several times once, in the order in which they were found: ids are names, and
/// nothing may depend on their order.
pub(crate) fn keep_each_once(found: &mut Vec<SupportPlane>) {
    let mut known = BTreeSet::new();
    found.retain(|plane| known.insert(plane.id));
}

/// The finite planes of a map, asked for what is near a point. A closure of the same arguments as
/// [`near`](Self::near) is one too.
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
    /// Adds to `found` the planes whose finite patch lies within `reach` metres of a point of the world.
    /// Walls and ceilings among them do no harm. Of planes between which nothing else decides, the first
    /// found counts: an order that says which planes are which in a map built again keeps results the same.
    fn near(&self, point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>);

    /// What a plane that objects were seen to stand on is called now: after a merge, the plane that it went
    /// into.
    fn current_id(&self, id: PlaneId) -> PlaneId {
        id
    }
}

impl<F: Fn([f64; 3], f64, &mut Vec<SupportPlane>)> SupportingPlanes for F {
    fn near(&self, point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>) {
        self(point, reach, found);
    }
}

/// No planes are known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct NoPlanes;

impl SupportingPlanes for NoPlanes {
    fn near(&self, _point: [f64; 3], _reach: f64, _found: &mut Vec<SupportPlane>) {}
}
