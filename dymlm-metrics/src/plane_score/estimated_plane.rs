/// A finite plane of a map to be scored, as `planes.json` holds it.
///
/// The normal may have any length; normal . x + d = 0. A plane without area (no ring of three points, zero
/// normal, values that are not finite) counts as a plane that matches nothing.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EstimatedPlane {
    /// Normal in the world, towards the side from which the plane was seen.
    pub normal: [f64; 3],
    /// Offset, metres (times the normal's length).
    pub d: f64,
    /// Closed rings in the world, with the last point joined to the first. By the even-odd rule, a ring
    /// within a ring is a hole. Points off the plane are projected onto it; points that are not finite are
    /// left out.
    pub boundary: Vec<Vec<[f64; 3]>>,
}
