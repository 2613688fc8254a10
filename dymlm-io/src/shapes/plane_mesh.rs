use std::ops::Range;

use dymlm_core::vector3::{any_across, cross, difference, dot, unit};
use earcut::Earcut;

use crate::PlaneRecord;

/// Largest number of corners of a drawn plane: more than a picture shows, and few enough for the
/// triangulation.
const MAX_CORNERS: usize = 1 << 20;

/// A plane's polygons with their holes, as triangles and as rings.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct PlaneMesh {
    /// Metres, in the world.
    pub(crate) corners: Vec<[f64; 3]>,
    /// Three corners per triangle, counterclockwise seen from the side that the normal points to.
    pub(crate) triangles: Vec<u32>,
    /// The range of corners of each ring.
    pub(crate) rings: Vec<Range<usize>>,
}

impl PlaneMesh {
    /// The mesh of a plane's rings: a counterclockwise outline, its clockwise holes, the next outline. Rings
    /// with less than three corners or with a corner that is not finite are left out.
    pub(crate) fn of(plane: &PlaneRecord) -> Self {
        let mut mesh = Self::default();
        let Some(axes) = plane_axes(plane.normal) else { return mesh };
        let is_ring = |ring: &&Vec<[f64; 3]>| ring.len() > 2 && ring.iter().flatten().all(|c| c.is_finite());
        let mut polygon: Vec<&[[f64; 3]]> = Vec::new();
        let mut earcut = Earcut::new();
        for ring in plane.boundary.iter().filter(is_ring) {
            if doubled_area(ring, axes) > 0.0 {
                mesh.add(&polygon, axes, &mut earcut);
                polygon.clear();
                polygon.push(ring);
            } else if !polygon.is_empty() {
                polygon.push(ring);
            }
        }
        mesh.add(&polygon, axes, &mut earcut);
        mesh
    }

    /// Adds a polygon: an outline and its holes.
    fn add(&mut self, rings: &[&[[f64; 3]]], axes: [[f64; 3]; 2], earcut: &mut Earcut<f64>) {
        let count: usize = rings.iter().map(|ring| ring.len()).sum();
        let first = self.corners.len();
        if count == 0 || first + count > MAX_CORNERS {
            return;
        }
        let mut holes: Vec<u32> = Vec::new();
        for ring in rings {
            let start = self.corners.len();
            if start > first {
                holes.push((start - first) as u32);
            }
            self.corners.extend_from_slice(ring);
            self.rings.push(start..self.corners.len());
        }
        let corners = self.corners.get(first..).unwrap_or_default();
        let flat: Vec<[f64; 2]> = corners.iter().map(|corner| flattened(*corner, axes)).collect();
        let mut triangles: Vec<u32> = Vec::new();
        earcut.earcut(flat.iter().copied(), &holes, &mut triangles);
        for &[a, b, c] in triangles.as_chunks().0 {
            let turned = match [a, b, c].map(|corner| flat.get(corner as usize).copied().unwrap_or_default())
            {
                [p, q, r] if signed([p, q, r]) < 0.0 => [a, c, b],
                _ => [a, b, c],
            };
            self.triangles.extend(turned.map(|corner| first as u32 + corner));
        }
    }
}

/// Two unit axes in a plane, whose cross product is its normal.
fn plane_axes(normal: [f64; 3]) -> Option<[[f64; 3]; 2]> {
    let normal = unit(normal)?;
    let u = unit(any_across(normal))?;
    Some([u, cross(normal, u)])
}

fn flattened(corner: [f64; 3], axes: [[f64; 3]; 2]) -> [f64; 2] {
    axes.map(|axis| dot(axis, corner))
}

/// Twice the area of a ring; positive when it runs counterclockwise.
fn doubled_area(ring: &[[f64; 3]], axes: [[f64; 3]; 2]) -> f64 {
    let Some(&origin) = ring.first() else { return 0.0 };
    let flat = |corner: [f64; 3]| flattened(difference(corner, origin), axes);
    ring.windows(2)
        .map(|pair| match pair {
            [a, b] => signed([[0.0; 2], flat(*a), flat(*b)]),
            _ => 0.0,
        })
        .sum()
}

/// Twice the area of a triangle, positive when it runs counterclockwise.
fn signed([a, b, c]: [[f64; 2]; 3]) -> f64 {
    (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use dymlm_core::vector3::norm;
    use proptest::prelude::*;

    use super::*;

    fn plane(normal: [f64; 3], boundary: Vec<Vec<[f64; 3]>>) -> PlaneRecord {
        PlaneRecord {
            id: 1,
            normal,
            d: 0.0,
            centroid: [0.0; 3],
            area_m2: 0.0,
            observations: 1,
            inliers: 1,
            boundary,
        }
    }

    /// The corners of a rectangle around a place on z = 0, counterclockwise seen from above.
    fn rectangle(center: [f64; 2], half: [f64; 2]) -> Vec<[f64; 3]> {
        [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]]
            .map(|[x, y]| [center[0] + x * half[0], center[1] + y * half[1], 0.0])
            .to_vec()
    }

    fn reversed(mut ring: Vec<[f64; 3]>) -> Vec<[f64; 3]> {
        ring.reverse();
        ring
    }

    /// The triangles' area seen along the normal: triangles of the wrong orientation count as negative.
    fn area(mesh: &PlaneMesh, normal: [f64; 3]) -> f64 {
        let corner = |index: u32| mesh.corners[index as usize];
        let of = |&[a, b, c]: &[u32; 3]| {
            let [a, b, c] = [a, b, c].map(corner);
            0.5 * dot(cross(difference(b, a), difference(c, a)), normal)
        };
        mesh.triangles.as_chunks().0.iter().map(of).sum()
    }

    #[test]
    fn holes_stay_open_and_islands_are_polygons_of_their_own() {
        let up = [0.0, 0.0, 1.0];
        let rings = vec![
            rectangle([0.0; 2], [2.0, 1.0]),
            reversed(rectangle([1.0, 0.0], [0.5, 0.5])),
            reversed(rectangle([-1.0, 0.0], [0.5, 0.25])),
            rectangle([10.0, 0.0], [1.0, 1.0]),
        ];
        let mesh = PlaneMesh::of(&plane(up, rings.clone()));
        assert!((area(&mesh, up) - (8.0 - 1.0 - 0.5 + 4.0)).abs() < 1e-12);
        assert_eq!(mesh.rings.len(), 4);
        assert_eq!(mesh.corners.len(), 16);
        // Seen from below, the same rings run the other way round.
        let below = PlaneMesh::of(&plane([0.0, 0.0, -1.0], rings.into_iter().map(reversed).collect()));
        assert!((area(&below, [0.0, 0.0, -1.0]) - 10.5).abs() < 1e-12);
    }

    #[test]
    fn what_is_no_polygon_gives_no_triangles() {
        let up = [0.0, 0.0, 1.0];
        let square = rectangle([0.0; 2], [1.0, 1.0]);
        let broken = [
            plane(up, Vec::new()),
            plane(up, vec![Vec::new(), vec![[0.0; 3]; 2]]),
            plane(up, vec![vec![[1.0, 1.0, 0.0]; 5]]),
            plane(up, vec![vec![[0.0; 3], [1.0, 0.0, 0.0], [f64::NAN, 1.0, 0.0]]]),
            plane(up, vec![reversed(square.clone())]),
            plane([0.0; 3], vec![square.clone()]),
            plane([f64::NAN, 0.0, 1.0], vec![square]),
        ];
        for plane in broken {
            assert_eq!(PlaneMesh::of(&plane).triangles, [0; 0], "{plane:?}");
        }
    }

    proptest! {
        /// Star-shaped outlines in any plane: the triangles' area equals that of Gauss's formula.
        #[test]
        fn triangles_cover_the_polygon(
            radii in proptest::collection::vec(0.1_f64..3.0, 3..40),
            normal in proptest::array::uniform3(-1.0_f64..1.0),
            shift in proptest::array::uniform3(-50.0_f64..50.0),
        ) {
            prop_assume!(norm(normal) > 0.1);
            let [u, v] = plane_axes(normal).unwrap();
            let step = std::f64::consts::TAU / radii.len() as f64;
            let ring: Vec<[f64; 3]> = radii.iter().enumerate().map(|(i, radius)| {
                let (sin, cos) = (step * i as f64).sin_cos();
                std::array::from_fn(|k| shift[k] + radius * (cos * u[k] + sin * v[k]))
            }).collect();
            let sectors = (0..radii.len()).map(|i| radii[i] * radii[(i + 1) % radii.len()]);
            let expected = 0.5 * step.sin() * sectors.sum::<f64>();
            let mesh = PlaneMesh::of(&plane(normal, vec![ring]));
            prop_assert!((area(&mesh, unit(normal).unwrap()) - expected).abs() < 1e-6 * expected.max(1.0));
        }
    }
}
