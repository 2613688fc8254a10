use dymlm_core::vector3::{Vector3, cross, difference, dot};

use super::facet::{Facet, NONE, side_of};

/// The convex hull of points in space as a closed surface of triangles.
///
/// Quickhull: starting from a tetrahedron, the point farthest outside a facet becomes a vertex, and the
/// facets that it sees are replaced by new ones between the point and their rim. Whether a facet is seen is
/// decided exactly, so the surface is closed and convex for any points; several facets may lie in one plane.
/// Points less than a tolerance outside are left out, so that rounding does not give a plane face thousands
/// of corners.
///
/// Barber, Dobkin, Huhdanpaa: "The Quickhull algorithm for convex hulls", ACM Transactions on Mathematical
/// Software 22, 1996. Exact signs: Shewchuk, "Adaptive precision floating-point arithmetic and fast robust
/// geometric predicates", 1997.
#[derive(Debug, Clone, Default)]
pub(crate) struct QuickHull {
    facets: Vec<Facet>,
    /// Facets that had points outside when they were made.
    pending: Vec<u32>,
    /// For each point, the next one in its facet's list of outside points.
    next: Vec<u32>,
    seen: Vec<u32>,
    rim: Vec<RimEdge>,
    /// For each vertex, the new facet on the rim's edge that begins there.
    facet_from: Vec<u32>,
    /// Number of searches for seen facets so far.
    asked: u32,
}

/// An edge between a facet that is seen and one that is not.
#[derive(Debug, Clone, Copy)]
struct RimEdge {
    from: u32,
    to: u32,
    /// The facet beyond, and which of its edges this is.
    beyond: u32,
    edge: usize,
}

impl QuickHull {
    /// Computes the hull of finite points, at most 2^32 - 1; points up to `tolerance` outside may be left
    /// out. False when the points are in one plane: then there is none.
    pub(crate) fn build(&mut self, points: &[Vector3], tolerance: f64) -> bool {
        self.facets.clear();
        self.pending.clear();
        self.asked = 0;
        let Some(tetrahedron) = tetrahedron(points) else { return false };
        self.next.clear();
        self.next.resize(points.len(), NONE);
        self.facet_from.clear();
        self.facet_from.resize(points.len(), NONE);
        self.begin(tetrahedron, points);
        (0..points.len() as u32).for_each(|point| self.keep_outside(0, point, points, tolerance));
        self.pending.extend(0..4);
        while let Some(facet) = self.pending.pop() {
            self.grow(facet, points, tolerance);
        }
        true
    }

    /// The triangles, counter-clockwise from outside.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = [u32; 3]> + '_ {
        self.alive().map(|facet| facet.vertices)
    }

    /// Their planes, as outward unit normal and offset: normal.x <= offset inside, to rounding.
    pub(crate) fn planes(&self) -> impl Iterator<Item = (Vector3, f64)> + '_ {
        self.alive().map(Facet::plane)
    }

    fn alive(&self) -> impl Iterator<Item = &Facet> + '_ {
        self.facets.iter().filter(|facet| facet.is_alive)
    }

    /// Adds the four facets of a tetrahedron, whose last vertex is above the first three.
    fn begin(&mut self, [a, b, c, d]: [u32; 4], points: &[Vector3]) {
        // Each with its neighbours beyond its first, second and third edge.
        let facets =
            [([a, c, b], [3, 2, 1]), ([a, b, d], [0, 2, 3]), ([b, c, d], [0, 3, 1]), ([c, a, d], [0, 1, 2])];
        self.facets.extend(facets.map(|(vertices, neighbors)| Facet::new(vertices, neighbors, points)));
    }

    /// Assigns a point to the first facet, from the index `from` on, that it is outside of.
    fn keep_outside(&mut self, from: usize, point: u32, points: &[Vector3], tolerance: f64) {
        for facet in &mut self.facets[from..] {
            let height = facet.height(points[point as usize]);
            if height <= tolerance || height.is_nan() {
                continue;
            }
            if facet.outside == NONE || height > facet.farthest {
                self.next[point as usize] = facet.outside;
                (facet.outside, facet.farthest) = (point, height);
            } else {
                let first = facet.outside as usize;
                self.next[point as usize] = self.next[first];
                self.next[first] = point;
            }
            return;
        }
    }

    /// Makes the point farthest outside a facet a vertex.
    fn grow(&mut self, facet: u32, points: &[Vector3], tolerance: f64) {
        let own = &mut self.facets[facet as usize];
        let eye = own.outside;
        if !own.is_alive || eye == NONE {
            return;
        }
        own.outside = self.next[eye as usize];
        if !own.is_below(points[eye as usize], points) {
            // The height was a rounding error of a sliver.
            return self.pending.push(facet);
        }
        self.find_rim(facet, eye, points);
        let first_new = self.facets.len();
        self.close_rim(eye, points);
        for at in 0..self.seen.len() {
            let seen = &mut self.facets[self.seen[at] as usize];
            seen.is_alive = false;
            let mut point = seen.outside;
            while point != NONE {
                let after = self.next[point as usize];
                self.keep_outside(first_new, point, points, tolerance);
                point = after;
            }
        }
        self.pending.extend(first_new as u32..self.facets.len() as u32);
    }

    /// Finds the facets that a point (the eye) sees, starting from one of them, and the edges around them.
    fn find_rim(&mut self, first: u32, eye: u32, points: &[Vector3]) {
        self.asked += 1;
        self.seen.clear();
        self.rim.clear();
        self.seen.push(first);
        let own = &mut self.facets[first as usize];
        (own.asked, own.is_seen) = (self.asked, true);
        let mut at = 0;
        while let Some(&facet) = self.seen.get(at) {
            let Facet { vertices, neighbors, .. } = self.facets[facet as usize];
            for edge in 0..3 {
                let beyond = neighbors[edge];
                if self.sees(eye, beyond, points) {
                    continue;
                }
                let (from, to) = (vertices[edge], vertices[(edge + 1) % 3]);
                let theirs = self.facets[beyond as usize].vertices;
                let edge = theirs.iter().position(|&vertex| vertex == to).unwrap_or(0);
                self.rim.push(RimEdge { from, to, beyond, edge });
            }
            at += 1;
        }
    }

    /// Whether an eye sees a facet; a seen facet is added to `seen` when it is first tested.
    fn sees(&mut self, eye: u32, facet: u32, points: &[Vector3]) -> bool {
        let own = &mut self.facets[facet as usize];
        if own.asked != self.asked {
            own.asked = self.asked;
            own.is_seen = own.is_below(points[eye as usize], points);
            if own.is_seen {
                self.seen.push(facet);
            }
        }
        own.is_seen
    }

    /// Adds the facets between an eye and the rim. The rim is a simple ring: each of its vertices begins one
    /// edge and ends one.
    fn close_rim(&mut self, eye: u32, points: &[Vector3]) {
        let first_new = self.facets.len() as u32;
        for (number, &RimEdge { from, to, beyond, edge }) in (first_new..).zip(&self.rim) {
            self.facets.push(Facet::new([from, to, eye], [beyond, NONE, NONE], points));
            self.facets[beyond as usize].neighbors[edge] = number;
            self.facet_from[from as usize] = number;
        }
        for (number, edge) in (first_new..).zip(&self.rim) {
            let after = self.facet_from[edge.to as usize];
            self.facets[number as usize].neighbors[1] = after;
            self.facets[after as usize].neighbors[2] = number;
        }
    }
}

/// Four points that are not in one plane, far apart; the last is above the first three. `None` when all are
/// in one plane.
fn tetrahedron(points: &[Vector3]) -> Option<[u32; 4]> {
    let first = *points.first()?;
    let a = farthest(points, |point| squared(difference(point, first)));
    let at = |index: u32| points[index as usize];
    let b = farthest(points, |point| squared(difference(point, at(a))));
    let along = difference(at(b), at(a));
    let c = farthest(points, |point| squared(cross(along, difference(point, at(a)))));
    let across = cross(along, difference(at(c), at(a)));
    let d = farthest(points, |point| dot(across, difference(point, at(a))).abs());
    let side = side_of(at(a), at(b), at(c), at(d));
    if side == 0.0 {
        return None;
    }
    Some(if side > 0.0 { [a, b, c, d] } else { [a, c, b, d] })
}

fn squared(a: Vector3) -> f64 {
    dot(a, a)
}

/// The first of the points with the greatest measure.
fn farthest(points: &[Vector3], measure: impl Fn(Vector3) -> f64) -> u32 {
    let (mut best, mut greatest) = (0, f64::NEG_INFINITY);
    for (index, &point) in (0..).zip(points) {
        let own = measure(point);
        if own > greatest {
            (best, greatest) = (index, own);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use dymlm_core::SplitMix64;

    use super::*;

    const TOLERANCE: f64 = 1e-9;

    /// Checks that the surface is closed (each edge once in each direction), without a hole, and convex: no
    /// point is above it.
    fn check(points: &[Vector3]) {
        let mut hull = QuickHull::default();
        assert!(hull.build(points, TOLERANCE));
        let triangles: Vec<[u32; 3]> = hull.triangles().collect();
        let edges: BTreeSet<(u32, u32)> =
            triangles.iter().flat_map(|&[a, b, c]| [(a, b), (b, c), (c, a)]).collect();
        assert_eq!(edges.len(), 3 * triangles.len());
        assert!(edges.iter().all(|&(from, to)| edges.contains(&(to, from))));
        let vertices: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
        assert_eq!(vertices.len() + triangles.len(), edges.len() / 2 + 2);
        for triangle in &triangles {
            let [a, b, c] = triangle.map(|vertex| points[vertex as usize]);
            assert!(vertices.iter().all(|&vertex| side_of(a, b, c, points[vertex as usize]) <= 0.0));
        }
        for (normal, offset) in hull.planes() {
            assert!(points.iter().all(|point| dot(normal, *point) <= offset + 10.0 * TOLERANCE));
        }
    }

    fn scattered(count: usize, seed: u64) -> Vec<Vector3> {
        let mut random = SplitMix64::new(seed);
        (0..count).map(|_| [0; 3].map(|_| 2.0 * random.fraction() - 1.0)).collect()
    }

    #[test]
    fn hulls_are_closed_and_convex() {
        for seed in 0..40 {
            let points = scattered(4 + 5 * seed as usize, seed);
            check(&points);
            // On a sphere all are vertices; on a lattice most are on common planes or lines, or coincide.
            check(&points.iter().map(|p| p.map(|x| x / dot(*p, *p).sqrt())).collect::<Vec<_>>());
            let lattice: Vec<Vector3> = points.iter().map(|p| p.map(|x| (1.5 * x).round())).collect();
            if lattice.len() > 20 {
                check(&lattice);
                let turned = lattice.iter().map(|&[x, y, z]| [0.6 * x - 0.8 * y, 0.8 * x + 0.6 * y, z + 1e3]);
                check(&turned.collect::<Vec<_>>());
            }
        }
    }

    #[test]
    fn a_cube_has_twelve_triangles() {
        let points: Vec<Vector3> =
            (0..27).map(|i| [i % 3, i / 3 % 3, i / 9].map(|x| f64::from(x) - 1.0)).collect();
        let mut hull = QuickHull::default();
        assert!(hull.build(&points, TOLERANCE));
        let vertices: BTreeSet<u32> = hull.triangles().flatten().collect();
        assert_eq!((hull.triangles().count(), vertices.len()), (12, 8));
    }

    #[test]
    fn what_is_in_one_plane_has_no_hull() {
        let mut hull = QuickHull::default();
        let plane: Vec<Vector3> = scattered(50, 1).iter().map(|&[x, y, _]| [x, y, 2.0]).collect();
        for points in [&[][..], &[[1.0; 3]; 9], &[[0.0; 3], [1.0; 3], [2.0; 3]], &plane] {
            assert!(!hull.build(points, TOLERANCE));
            assert_eq!(hull.triangles().count(), 0);
        }
    }
}
