use super::contour::{DIRECTIONS, Run, contours};
use super::raster::Raster;
use super::{PlanCell, PlanGrid};

/// A straight wall as a box: one of its sides is what is seen of it, the others are within solid matter.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct WallBox {
    /// Lower and upper corner on the floor, metres.
    pub(super) low: [f64; 2],
    pub(super) high: [f64; 2],
}

/// Greatest thickness of a wall's box, metres: that of a wall of bricks.
const THICKNESS: f64 = 0.2;
/// Thickness as a share of the solid matter behind the face: less than a half, so that the boxes of a wall's two
/// faces have no side in common.
const SHARE: f64 = 0.45;
/// How far boxes reach into each other where walls meet in the corner of a room, metres, so that no ray passes
/// between them. More would let the faces on both sides of a thin wall's end continue each other.
const LAP: f64 = 0.001;

/// One box for each straight face of the solid cells from which free floor is seen.
///
/// Boxes for faces, not for what stands between faces, make each box's side a face as it is seen: a box through a
/// wall would have one side for the two faces that another wall parts.
pub(super) fn wall_boxes(grid: &PlanGrid, solid: &Raster) -> Vec<WallBox> {
    let contours = contours(solid);
    let boxes = contours.iter().flat_map(|runs| (0..runs.len()).map(move |k| (runs, k)));
    boxes.filter_map(|(runs, k)| wall_box(grid, solid, runs, k)).collect()
}

fn wall_box(grid: &PlanGrid, solid: &Raster, runs: &[Run], k: usize) -> Option<WallBox> {
    let n = runs.len();
    let (run, before, after) = (runs[k], runs[(k + n - 1) % n], runs[(k + 1) % n]);
    let inward = DIRECTIONS[(run.heading + 1) % 4];
    let is_free = |[x, y]: [i64; 2]| {
        let is_within = x >= 0 && y >= 0 && x < grid.width as i64 && y < grid.height as i64;
        is_within && grid.cells[y as usize * grid.width + x as usize] == PlanCell::Free && !solid.at(x, y)
    };
    let (axis, is_forward) = (run.heading % 2, run.heading < 2);
    let [first, last] =
        if is_forward { [before.offset, after.offset] } else { [after.offset, before.offset] };
    // The solid cells of the run: the first cell behind its line.
    let row = if run.heading == 0 || run.heading == 3 { run.offset } else { run.offset - 1 };
    let cells = (first..last).map(|t| if axis == 0 { [t, row] } else { [row, t] });
    let deepest = (THICKNESS / SHARE / grid.resolution).ceil() as i64;
    let behind = |[x, y]: [i64; 2], far: i64| [x + far * inward[0], y + far * inward[1]];
    let depth = |cell: [i64; 2]| (1..deepest).find(|&far| is_free(behind(cell, far))).unwrap_or(deepest);
    if !cells.clone().any(|cell| is_free(behind(cell, -1))) {
        return None;
    }
    let depth = cells.map(depth).min()? as f64 * grid.resolution;
    let thickness = (SHARE * depth).min(THICKNESS);

    // Where the contour turns right, another wall begins on the seen side.
    let lap_before = if (before.heading + 3) % 4 == run.heading { LAP } else { 0.0 };
    let lap_after = if (run.heading + 3) % 4 == after.heading { LAP } else { 0.0 };
    let laps = if is_forward { [lap_before, lap_after] } else { [lap_after, lap_before] };
    let metres = |axis: usize, offset: i64| grid.origin[axis] + offset as f64 * grid.resolution;
    let along = [metres(axis, first) - laps[0], metres(axis, last) + laps[1]];
    let face = metres(1 - axis, run.offset);
    let back = face + inward[1 - axis] as f64 * thickness;
    let across = [face.min(back), face.max(back)];
    let [x, y] = if axis == 0 { [along, across] } else { [across, along] };
    Some(WallBox { low: [x[0], y[0]], high: [x[1], y[1]] })
}
