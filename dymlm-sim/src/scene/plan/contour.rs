use super::raster::Raster;

/// Directions of headings: +x, +y, -x, -y.
pub(super) const DIRECTIONS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];

/// A straight piece of a contour, with the solid cells on its left: sides of cells in a row.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Run {
    /// Index of its direction in [`DIRECTIONS`].
    pub(super) heading: usize,
    /// The coordinate that all its points have in common, in cells: y for headings along x, else x.
    pub(super) offset: i64,
    /// Number of sides of cells.
    pub(super) length: i64,
}

/// The contours around and within the solid cells. Each is closed, and its runs turn left or right into each
/// other. Cells that touch at a corner hang together.
pub(super) fn contours(solid: &Raster) -> Vec<Vec<Run>> {
    // For each cell, the sides that contours have passed: side 0 is below it, with the heading 0.
    let mut passed = vec![[false; 4]; solid.cells.len()];
    let mut contours = Vec::new();
    for first in 0..solid.cells.len() {
        for heading in 0..4 {
            let [x, y] = solid.place(first);
            if solid.cells[first] && !passed[first][heading] && is_side(solid, [x, y], heading) {
                contours.push(runs(&follow(solid, [x, y], heading, &mut passed)));
            }
        }
    }
    contours
}

/// Whether beyond the side of a cell along which a contour has this heading, nothing is solid.
fn is_side(solid: &Raster, [x, y]: [i64; 2], heading: usize) -> bool {
    let [dx, dy] = right_of(heading);
    !solid.at(x + dx, y + dy)
}

fn right_of(heading: usize) -> [i64; 2] {
    DIRECTIONS[(heading + 3) % 4]
}

/// The headings and offsets of all sides of a contour from one of its sides on.
fn follow(
    solid: &Raster,
    start: [i64; 2],
    start_heading: usize,
    passed: &mut [[bool; 4]],
) -> Vec<(usize, i64)> {
    let mut sides = Vec::new();
    let ([mut x, mut y], mut heading) = (start, start_heading);
    loop {
        let index = y as usize * solid.width + x as usize;
        passed[index][heading] = true;
        sides.push((heading, [y, x + 1, y + 1, x][heading]));
        let ([ahead_x, ahead_y], [right_x, right_y]) = (DIRECTIONS[heading], right_of(heading));
        let straight = [x + ahead_x, y + ahead_y];
        let right = [straight[0] + right_x, straight[1] + right_y];
        // Right first: so a corner at which two cells touch does not part them.
        if solid.at(right[0], right[1]) {
            ([x, y], heading) = (right, (heading + 3) % 4);
        } else if solid.at(straight[0], straight[1]) {
            [x, y] = straight;
        } else {
            heading = (heading + 1) % 4;
        }
        if ([x, y], heading) == (start, start_heading) {
            return sides;
        }
    }
}

/// Joins sides that continue each other.
fn runs(sides: &[(usize, i64)]) -> Vec<Run> {
    // A contour has corners; it is cut at one.
    let corner = (1..sides.len()).find(|&k| sides[k].0 != sides[k - 1].0).unwrap_or(0);
    let mut runs: Vec<Run> = Vec::new();
    for &(heading, offset) in sides[corner..].iter().chain(&sides[..corner]) {
        match runs.last_mut() {
            Some(run) if run.heading == heading => run.length += 1,
            _ => runs.push(Run { heading, offset, length: 1 }),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    fn raster(rows: &[&str]) -> Raster {
        // The first row is the lowest.
        let cells: Vec<u8> = rows.concat().into_bytes();
        Raster::of(&cells, rows[0].len(), |&cell| cell == b'#')
    }

    #[test]
    fn a_ring_has_a_contour_around_and_one_within() {
        let contours = contours(&raster(&[".....", ".###.", ".#.#.", ".###.", "....."]));
        let offsets: Vec<Vec<(usize, i64, i64)>> = contours
            .iter()
            .map(|runs| runs.iter().map(|run| (run.heading, run.offset, run.length)).collect())
            .collect();
        assert_eq!(offsets.len(), 2);
        // The solid cells are on the left: counterclockwise around, clockwise within.
        let mut outer = offsets[0].clone();
        outer.sort_unstable();
        assert_eq!(outer, [(0, 1, 3), (1, 4, 3), (2, 4, 3), (3, 1, 3)]);
        let mut inner = offsets[1].clone();
        inner.sort_unstable();
        assert_eq!(inner, [(0, 3, 1), (1, 2, 1), (2, 2, 1), (3, 3, 1)]);
    }

    #[test]
    fn cells_that_touch_at_a_corner_have_one_contour() {
        let contours = contours(&raster(&["##..", "..##"]));
        assert_eq!(contours.len(), 1);
        let sides: i64 = contours[0].iter().map(|run| run.length).sum();
        assert_eq!(sides, 12);
    }
}
