//! The boundary of a finite plane as polygons with holes.
//!
//! The cells of the plane that hold inliers form a picture. Small holes are filled; then the sides between
//! filled and empty cells are traced into rings (marching squares on a picture whose samples are its cells),
//! and corners that are only steps of cells are dropped from the rings. All but the last step use integers,
//! so they are exact and deterministic. O(cells).

mod filled_cells;
mod outline;
mod polygon;
mod simplify;

pub(crate) use filled_cells::FilledCells;
pub(crate) use outline::CellPicture;
pub use polygon::BoundaryPolygon;

use outline::{Ring, contains, doubled_area};
use simplify::simplify_ring;

use crate::plane_frame::PlaneFrame;

/// The polygons around a picture's cells, which are `cell_size` metres wide, largest first.
pub(crate) fn trace_boundary(
    picture: &CellPicture,
    frame: PlaneFrame,
    cell_size: f64,
    tolerance: f64,
) -> Vec<BoundaryPolygon> {
    let (mut outlines, holes): (Vec<Ring>, Vec<Ring>) =
        picture.rings().into_iter().partition(|ring| doubled_area(ring) > 0);
    // The sort is stable: rings of equal area stay in the order in which they were traced.
    outlines.sort_by_key(|ring| std::cmp::Reverse(doubled_area(ring)));

    let to_polygon = |ring: &Ring| -> Vec<[f64; 3]> {
        let corners: Vec<[f64; 2]> = ring.iter().map(|corner| corner.map(|c| c as f64 * cell_size)).collect();
        simplify_ring(&corners, tolerance).into_iter().map(|corner| frame.to_world(corner)).collect()
    };
    let mut polygons: Vec<BoundaryPolygon> = outlines
        .iter()
        .map(|ring| BoundaryPolygon { outline: to_polygon(ring), holes: Vec::new() })
        .collect();
    for hole in &holes {
        // A hole belongs to the smallest outline around the filled cell beside its first corner.
        let owner = (0..outlines.len()).rev().find(|&index| contains(&outlines[index], beside(hole)));
        if let Some(owner) = owner {
            polygons[owner].holes.push(to_polygon(hole));
        }
    }
    polygons
}

/// The centre, at doubled coordinates, of a filled cell beside a ring: left of its first side.
fn beside(ring: &Ring) -> [i64; 2] {
    let (Some(&a), Some(&b)) = (ring.first(), ring.get(1)) else { return [0, 0] };
    let (du, dv) = ((b[0] - a[0]).signum(), (b[1] - a[1]).signum());
    // Half a cell ahead, half a cell to the left.
    [2 * a[0] + du - dv, 2 * a[1] + dv + du]
}
