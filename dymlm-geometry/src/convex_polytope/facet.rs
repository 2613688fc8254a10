use dymlm_core::vector3::{Vector3, cross, difference, dot, norm};
use robust::{Coord3D, orient3d};

/// No point.
pub(super) const NONE: u32 = u32::MAX;

/// A triangle of a hull that grows.
#[derive(Debug, Clone)]
pub(super) struct Facet {
    /// Counter-clockwise, seen from outside.
    pub(super) vertices: [u32; 3],
    /// The facet beyond the edge from each vertex to the next.
    pub(super) neighbors: [u32; 3],
    /// Outward, of length 1 but for rounding; the normal of a sliver may have any direction.
    normal: Vector3,
    /// normal.x on the plane.
    offset: f64,
    /// The farthest of the outside points assigned to the facet; the others follow in the hull's list `next`.
    pub(super) outside: u32,
    /// Height of that point above the facet.
    pub(super) farthest: f64,
    /// The number of the search in which the facet was last tested, and whether it was seen; see `QuickHull`.
    pub(super) asked: u32,
    pub(super) is_seen: bool,
    /// Whether the facet is still on the hull.
    pub(super) is_alive: bool,
}

impl Facet {
    pub(super) fn new(vertices: [u32; 3], neighbors: [u32; 3], points: &[Vector3]) -> Self {
        let [a, b, c] = vertices.map(|vertex| points[vertex as usize]);
        let normal = cross(difference(b, a), difference(c, a));
        let length = norm(normal);
        let normal = normal.map(|x| x / length);
        Self {
            vertices,
            neighbors,
            normal,
            offset: dot(normal, a),
            outside: NONE,
            farthest: 0.0,
            asked: 0,
            is_seen: false,
            is_alive: true,
        }
    }

    /// How far a point is above the facet's plane, negative below; off by rounding, by more for slivers.
    #[inline]
    pub(super) fn height(&self, point: Vector3) -> f64 {
        dot(self.normal, point) - self.offset
    }

    /// Whether a point is above the facet's plane; exact.
    pub(super) fn is_below(&self, point: Vector3, points: &[Vector3]) -> bool {
        let [a, b, c] = self.vertices.map(|vertex| points[vertex as usize]);
        side_of(a, b, c, point) > 0.0
    }

    /// The facet's plane as normal and offset.
    pub(super) fn plane(&self) -> (Vector3, f64) {
        (self.normal, self.offset)
    }
}

/// Positive where a, b, c are counter-clockwise seen from d, negative where clockwise, 0 in one plane; its
/// sign is exact.
pub(super) fn side_of(a: Vector3, b: Vector3, c: Vector3, d: Vector3) -> f64 {
    let [a, b, c, d] = [a, b, c, d].map(|[x, y, z]| Coord3D { x, y, z });
    // Positive where d is below the plane from whose upper side a, b, c are counter-clockwise.
    -orient3d(a, b, c, d)
}
