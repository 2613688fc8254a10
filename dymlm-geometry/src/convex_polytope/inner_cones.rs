use dymlm_core::vector3::{Vector3, cross, difference, dot};

use super::{QuickHull, VertexGraph};

/// Cells along each side of the two squares of directions; even.
const CELLS: usize = 24;
const CORNERS: usize = CELLS + 1;

/// Adding this to a number between -2^51 and 2^51 leaves its nearest integer in the lowest bits.
const ROUNDER: u64 = 3 << 51;

/// Share by which the region is smaller than it could be; rounding is far below.
const MARGIN: f64 = 1e-9;

/// The part of a convex polytope that is surely inside: in each of several hundred cones from its centre, the
/// space below a plane through the surface.
///
/// Cones have square bases on the octahedron |x| + |y| + |z| = 1, seen along z from above and from below: so
/// a point's cone is found without a branch. Of the squares along the rim, halves are used.
#[derive(Debug, Clone, Default)]
pub(crate) struct InnerCones {
    center: Vector3,
    /// For each cell of directions the normal m of the plane m.(x - centre) = 1; NaN where nothing is inside.
    planes: Vec<Vector3>,
    /// The normal m of each of the polytope's facets, coordinate by coordinate.
    facets: [Vec<[f64; LANES]>; 3],
    /// The surface's points in the directions of the cells' corners, relative to the centre.
    corners: Vec<Option<Vector3>>,
}

/// Number of facets side by side in vector registers.
const LANES: usize = 4;

impl InnerCones {
    /// Takes the region from a hull.
    pub(crate) fn fill(&mut self, hull: &QuickHull, graph: &VertexGraph) {
        let vertices = graph.vertices();
        let sum =
            vertices.iter().fold([0.0; 3], |sum: Vector3, vertex| [0, 1, 2].map(|k| sum[k] + vertex[k]));
        self.center = sum.map(|x| x / vertices.len() as f64);
        self.take_facets(hull);
        self.planes.clear();
        for side in [1.0, -1.0] {
            self.take_corners(side);
            for cell in 0..CELLS * CELLS {
                let corner = cell % CELLS + cell / CELLS * CORNERS;
                let around = [corner, corner + 1, corner + CORNERS + 1, corner + CORNERS];
                self.planes.push(plane_below(around.map(|at| self.corners[at])));
            }
        }
    }

    /// Whether four points are all surely inside; for points that are not finite the answer is arbitrary.
    #[inline]
    pub(crate) fn contain_all(&self, points: &[Vector3; 4]) -> bool {
        points.iter().fold(true, |all, point| all & self.contain(*point))
    }

    /// Whether a point is surely inside; for a point that is not finite the answer is arbitrary.
    #[inline]
    pub(crate) fn contain(&self, point: Vector3) -> bool {
        let own = difference(point, self.center);
        self.planes.get(cell_of(own)).is_some_and(|plane| dot(*plane, own) < 1.0)
    }

    fn take_facets(&mut self, hull: &QuickHull) {
        self.facets.iter_mut().for_each(Vec::clear);
        for (index, (normal, offset)) in hull.planes().enumerate() {
            let distance = offset - dot(normal, self.center);
            for (facets, x) in self.facets.iter_mut().zip(normal) {
                if index % LANES == 0 {
                    facets.push([0.0; LANES]);
                }
                if let Some(last) = facets.last_mut() {
                    last[index % LANES] = x / distance;
                }
            }
        }
    }

    /// Finds the surface's points at the corners of the upper or lower side.
    fn take_corners(&mut self, side: f64) {
        self.corners.clear();
        for corner in 0..CORNERS * CORNERS {
            let [u, v] = [corner % CORNERS, corner / CORNERS].map(|i| i as isize - CELLS as isize / 2);
            let above = CELLS as isize / 2 - u.abs() - v.abs();
            self.corners.push((above >= 0).then(|| {
                let direction = [u as f64, v as f64, side * above as f64];
                let per_length = self.greatest_slope(direction);
                direction.map(|x| x / per_length)
            }));
        }
    }

    /// One over the multiple of this direction at which the surface is reached; not finite where a sliver
    /// among the facets has no normal.
    fn greatest_slope(&self, [u, v, w]: Vector3) -> f64 {
        let [x, y, z] = &self.facets;
        let mut greatest = [0.0; LANES];
        for ((x, y), z) in x.iter().zip(y).zip(z) {
            for lane in 0..LANES {
                let slope = u * x[lane] + v * y[lane] + w * z[lane];
                greatest[lane] = if slope > greatest[lane] { slope } else { greatest[lane] };
            }
        }
        greatest.into_iter().fold(0.0, f64::max)
    }
}

/// The cell that a direction is in; any cell when the direction is not finite or has no length.
#[inline]
fn cell_of([x, y, z]: Vector3) -> usize {
    let rounder = ROUNDER as f64;
    let per_length = 0.5 * CELLS as f64 / (x.abs() + y.abs() + z.abs());
    // Half a cell less, so that the nearest integer is the cell.
    let half_cell = 0.5 * (CELLS - 1) as f64;
    let cell = |x: f64| {
        let rounded = x * per_length + half_cell + rounder;
        // One of the corners of the square belongs to the cell before it.
        rounded.to_bits().wrapping_sub(rounder.to_bits()).min(CELLS as u64 - 1)
    };
    let below = z.to_bits() >> 63;
    ((below * CELLS as u64 + cell(y)) * CELLS as u64 + cell(x)) as usize
}

/// The plane across a cone that is above none of the surface's points on the cone's edges, so that the space
/// below the plane is between these points and the apex. A half cone has three edges.
fn plane_below(corners: [Option<Vector3>; 4]) -> Vector3 {
    let normal = match corners {
        [Some(a), Some(b), Some(c), Some(d)] => cross(difference(c, a), difference(d, b)),
        [None, Some(a), Some(b), Some(c)]
        | [Some(a), None, Some(b), Some(c)]
        | [Some(a), Some(b), None, Some(c)]
        | [Some(a), Some(b), Some(c), None] => cross(difference(b, a), difference(c, a)),
        _ => return [f64::NAN; 3],
    };
    let offsets = corners.into_iter().flatten().map(|corner| dot(normal, corner));
    let nothing = [f64::INFINITY, f64::NEG_INFINITY];
    let [least, greatest] =
        offsets.fold(nothing, |[least, greatest], offset| [least.min(offset), greatest.max(offset)]);
    // Which way the normal points depends on which way round the corners go.
    let offset = match () {
        () if least > 0.0 => least,
        () if greatest < 0.0 => greatest,
        () => f64::NAN,
    };
    normal.map(|x| x * (1.0 + MARGIN) / offset)
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;

    use super::*;

    #[test]
    fn nothing_outside_is_taken_for_inside_and_most_of_what_is_inside_is_known() {
        let mut random = SplitMix64::new(1);
        let (mut hull, mut graph, mut inner) =
            (QuickHull::default(), VertexGraph::default(), InnerCones::default());
        for count in [4, 8, 30, 200, 1000] {
            let mut point = || -> Vector3 { [0; 3].map(|_| 2.0 * random.fraction() - 1.0) };
            let points: Vec<Vector3> = (0..count).map(|_| point()).collect();
            assert!(hull.build(&points, 0.0));
            graph.fill(&hull, &points);
            inner.fill(&hull, &graph);
            let (mut inside, mut known) = (0, 0);
            for own in (0..20_000).map(|_| point()) {
                let is_inside = hull.planes().all(|(normal, offset)| dot(normal, own) < offset);
                assert!(is_inside || !inner.contain(own), "{own:?}");
                inside += usize::from(is_inside);
                known += usize::from(inner.contain(own));
            }
            assert!(known * 10 >= inside * 8, "{known} of {inside} with {count}");
        }
    }

    /// The corners of the squares of directions are at their cells' rims.
    #[test]
    fn what_is_straight_along_an_axis_is_told_from_its_opposite() {
        let (mut hull, mut graph, mut inner) =
            (QuickHull::default(), VertexGraph::default(), InnerCones::default());
        let signs = [1.0, -1.0];
        let points: Vec<Vector3> = (0..3)
            .flat_map(|axis| signs.map(|sign| [0, 1, 2].map(|k| if k == axis { sign } else { 0.0 })))
            .collect();
        assert!(hull.build(&points, 0.0));
        graph.fill(&hull, &points);
        inner.fill(&hull, &graph);
        for point in points {
            assert!(
                inner.contain(point.map(|x| 0.999 * x)) && !inner.contain(point.map(|x| 1.001 * x)),
                "{point:?}"
            );
        }
    }
}
