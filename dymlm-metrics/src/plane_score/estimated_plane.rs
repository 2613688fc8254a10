/// A finite plane of a map to be scored: what `planes.json` holds of it.
///
/// The normal may have any length; normal . x + d = 0. A plane without area (no ring of three points, normal
/// zero, values that are not finite) counts as a plane that matches nothing.
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct EstimatedPlane {
    /// Normal in the world, towards where the plane was seen from.
    pub normal: [f64; 3],
    /// Offset, metres (times the normal's length).
    pub d: f64,
    /// Closed rings in the world, the last point joined to the first; inside is what an odd number of rings
    /// encloses, so that a ring within a ring is a hole. Points off the plane are projected onto it; points
    /// that are not finite are left out.
    pub boundary: Vec<Vec<[f64; 3]>>,
}
