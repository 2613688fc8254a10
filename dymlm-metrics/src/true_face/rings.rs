use std::collections::BTreeMap;

use super::cell_raster::CellRaster;

/// A corner of cells: row and column, counted from the first corner.
type Corner = (usize, usize);

/// Rings along the outer sides of the marked cells: counterclockwise around cells, clockwise around holes.
/// Cells that only meet at a corner have separate rings.
///
/// O(n log n) in the number of sides.
pub(super) fn rings_around(raster: &CellRaster, marked: &[bool]) -> Vec<Vec<[f64; 3]>> {
    let mut sides = outer_sides(raster, marked);
    let mut rings = Vec::new();
    while let Some((&start, _)) = sides.first_key_value() {
        let mut ring = Vec::new();
        let (mut at, mut from) = (start, None);
        while let Some(to) = take_next(&mut sides, at, from) {
            // Only the ends of a straight run are kept.
            if from.is_none_or(|from| turn(from, at, to) != 0) {
                ring.push(raster.corner_at(at.1, at.0));
            }
            (from, at) = (Some(at), to);
        }
        rings.push(ring);
    }
    rings
}

/// The sides between marked and other cells, with the marked cell on the left, by their start corners.
fn outer_sides(raster: &CellRaster, marked: &[bool]) -> BTreeMap<Corner, Vec<Corner>> {
    let (columns, rows) = (raster.columns(), raster.rows());
    let is_marked = |row: Option<usize>, column: Option<usize>| match (row, column) {
        (Some(row), Some(column)) if row < rows && column < columns => marked[row * columns + column],
        _ => false,
    };
    let mut sides: BTreeMap<Corner, Vec<Corner>> = BTreeMap::new();
    for row in 0..rows {
        for column in (0..columns).filter(|column| marked[row * columns + column]) {
            let around = [
                (row.checked_sub(1), Some(column), (row, column), (row, column + 1)),
                (Some(row), Some(column + 1), (row, column + 1), (row + 1, column + 1)),
                (Some(row + 1), Some(column), (row + 1, column + 1), (row + 1, column)),
                (Some(row), column.checked_sub(1), (row + 1, column), (row, column)),
            ];
            for (row, column, from, to) in around {
                if !is_marked(row, column) {
                    sides.entry(from).or_default().push(to);
                }
            }
        }
    }
    sides
}

/// Takes the side that continues from `at`. At a corner with two, it takes the one that turns left, around
/// the same cell.
fn take_next(sides: &mut BTreeMap<Corner, Vec<Corner>>, at: Corner, from: Option<Corner>) -> Option<Corner> {
    let onward = sides.get_mut(&at)?;
    let left = from.and_then(|from| onward.iter().position(|&to| turn(from, at, to) > 0));
    let to = onward.swap_remove(left.unwrap_or(0));
    if onward.is_empty() {
        sides.remove(&at);
    }
    Some(to)
}

/// Positive for a left turn, zero for straight on.
fn turn(from: Corner, at: Corner, to: Corner) -> i64 {
    let step = |a: Corner, b: Corner| (b.1 as i64 - a.1 as i64, b.0 as i64 - a.0 as i64);
    let ((x0, y0), (x1, y1)) = (step(from, at), step(at, to));
    x0 * y1 - y0 * x1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rings(rows: &[&str]) -> Vec<usize> {
        let (columns, count) = (rows[0].len() as f64, rows.len() as f64);
        let corners = [[0.0, 0.0, 0.0], [columns, count, 0.0]];
        let raster = CellRaster::around(corners.into_iter(), [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], 1.0).unwrap();
        let marked: Vec<bool> = rows.iter().flat_map(|row| row.bytes().map(|byte| byte == b'#')).collect();
        let rings = rings_around(&raster, &marked);
        assert_eq!(raster.fill(&rings), marked, "filling the rings gives the cells");
        rings.iter().map(Vec::len).collect()
    }

    #[test]
    fn rings_enclose_the_cells() {
        assert_eq!(rings(&["..", ".."]), [0; 0]);
        assert_eq!(rings(&["##", "##"]), [4]);
        assert_eq!(rings(&["#.", "##"]), [6]);
        assert_eq!(rings(&["###", "#.#", "###"]), [4, 4]);
        // Cells that only meet at a corner have separate rings, and so have holes.
        assert_eq!(rings(&["#.", ".#"]), [4, 4]);
        assert_eq!(rings(&["####", "#.##", "##.#", "####"]).len(), 2);
        assert_eq!(rings(&["#.#.", ".#.#", "#.#."]), [4; 6]);
    }
}
