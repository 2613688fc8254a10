use super::contour::{Run, contours};
use super::raster::Raster;

/// Sides of cells that become one wall are at most this many cells apart across the wall: what a laser sees of
/// one flat wall falls into a row of cells and spills over into those on both sides.
const SPREAD: i64 = 2;

/// Runs that have become one.
#[derive(Debug, Clone, Copy)]
struct Wall {
    heading: usize,
    lowest: i64,
    /// How many sides of cells there are at the lowest offset and at the following ones.
    sides: [i64; SPREAD as usize + 1],
}

/// Solid cells with straight walls: where a contour jumps by a cell or two and goes on as before, one straight
/// line at the median of its offsets takes the place of both.
pub(super) fn straighten(solid: &Raster) -> Raster {
    let mut winding = vec![0_i32; (solid.width + 1) * solid.height];
    for contour in contours(solid) {
        let walls = join_walls(contour.into_iter().map(Wall::new).collect());
        for (k, wall) in walls.iter().enumerate().filter(|(_, wall)| wall.heading % 2 == 1) {
            let [from, to] = ends(&walls, k);
            // What is to the right of a line that leads down is solid.
            let change = if from > to { 1 } else { -1 };
            for y in from.min(to)..from.max(to) {
                winding[y as usize * (solid.width + 1) + wall.offset() as usize] += change;
            }
        }
    }
    let mut straight = solid.clone();
    for (row, cells) in winding.chunks(solid.width + 1).zip(straight.cells.chunks_mut(solid.width)) {
        let mut turns = 0;
        for (cell, change) in cells.iter_mut().zip(row) {
            turns += change;
            *cell = turns > 0;
        }
    }
    keep_all_things(solid, &mut straight);
    straight
}

/// Coordinates at which a line of a closed contour begins and ends: those of the lines before and after it.
fn ends(walls: &[Wall], k: usize) -> [i64; 2] {
    let n = walls.len();
    [walls[(k + n - 1) % n].offset(), walls[(k + 1) % n].offset()]
}

/// Joins what is one wall, short pieces first, so that a long wall takes in its rough places and not they it.
fn join_walls(mut walls: Vec<Wall>) -> Vec<Wall> {
    let longest = walls.iter().map(Wall::length).sum();
    let (mut limit, mut unchanged) = (1, 0);
    while limit < longest || unchanged < 2 {
        let before = walls.len();
        // The seam of the closed contour moves, so that it hides no jump.
        walls.rotate_left(before / 2);
        walls = sweep(&walls, limit);
        unchanged = if walls.len() == before { unchanged + 1 } else { 0 };
        if unchanged == 2 {
            (limit, unchanged) = (2 * limit, if limit < longest { 0 } else { 2 });
        }
    }
    walls
}

/// Joins pairs of lines with a jump between them, of which at least one is not longer than `limit`.
fn sweep(walls: &[Wall], limit: i64) -> Vec<Wall> {
    let mut joined: Vec<Wall> = Vec::with_capacity(walls.len());
    for wall in walls {
        let before = joined.len().checked_sub(2).map(|k| joined[k]);
        let both = before
            .filter(|before| before.length().min(wall.length()) <= limit)
            .and_then(|before| before.joined(wall));
        if let Some(both) = both {
            joined.truncate(joined.len() - 2);
            joined.push(both);
        } else {
            joined.push(*wall);
        }
    }
    joined
}

impl Wall {
    fn new(run: Run) -> Self {
        let mut sides = [0; SPREAD as usize + 1];
        sides[0] = run.length;
        Self { heading: run.heading, lowest: run.offset, sides }
    }

    fn length(&self) -> i64 {
        self.sides.iter().sum()
    }

    /// Both as one; `None` when they are not parallel or too far apart.
    fn joined(&self, other: &Self) -> Option<Self> {
        let lowest = self.lowest.min(other.lowest);
        let mut sides = [0; SPREAD as usize + 1];
        for wall in [self, other] {
            for (k, count) in wall.sides.iter().enumerate().filter(|(_, count)| **count > 0) {
                *sides.get_mut((wall.lowest - lowest) as usize + k)? += count;
            }
        }
        (self.heading == other.heading).then_some(Self { heading: self.heading, lowest, sides })
    }

    /// The median of its sides' offsets; of two medians the one farther out, so that walls do not vanish.
    fn offset(&self) -> i64 {
        let is_low_out = self.heading == 0 || self.heading == 3;
        let half = self.length();
        let mut below = 0;
        for (k, count) in self.sides.iter().enumerate() {
            below += 2 * count;
            if below > half || (below == half && is_low_out) {
                return self.lowest + k as i64;
            }
        }
        self.lowest
    }
}

/// Puts back what straightening has lost: cells that nothing solid is near any more.
fn keep_all_things(solid: &Raster, straight: &mut Raster) {
    let is_lost = |&cell: &usize| {
        let [x, y] = solid.place(cell);
        let mut near = (-SPREAD..=SPREAD).flat_map(|dy| (-SPREAD..=SPREAD).map(move |dx| [x + dx, y + dy]));
        solid.cells[cell] && !straight.cells[cell] && !near.any(|[x, y]| straight.at(x, y))
    };
    let lost: Vec<usize> = (0..solid.cells.len()).filter(is_lost).collect();
    for cell in lost {
        straight.cells[cell] = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn straightened(rows: &[&str]) -> Vec<String> {
        let cells: Vec<u8> = rows.concat().into_bytes();
        let solid = Raster::of(&cells, rows[0].len(), |&cell| cell == b'#');
        let straight = straighten(&solid);
        let row = |cells: &[bool]| cells.iter().map(|&cell| if cell { '#' } else { '.' }).collect();
        straight.cells.chunks(solid.width).map(row).collect()
    }

    #[test]
    fn what_is_straight_stays() {
        // Two rooms with a door between them, and a pillar.
        let rows = [
            "##############",
            "#......#.....#",
            "#......#.....#",
            "#.###..#.....#",
            "#.###........#",
            "#.###........#",
            "#............#",
            "#......#.....#",
            "#......#.....#",
            "#......#.....#",
            "##############",
        ];
        assert_eq!(straightened(&rows), rows);
    }

    #[test]
    fn rough_walls_become_straight_lines_at_their_median() {
        // Bumps, a notch, and a wall that goes on one cell farther up.
        let rough = [
            "####################",
            "####.#########..####",
            ".#......#.##........",
            "....................",
            "....................",
            "........############",
            "########.###########",
            "########.###########",
        ];
        let straight = [
            "####################",
            "####################",
            "....................",
            "....................",
            "....................",
            "####################",
            "####################",
            "####################",
        ];
        assert_eq!(straightened(&rough), straight);
    }

    #[test]
    fn a_wall_of_one_cell_that_changes_rows_stays_one_wall() {
        let got = straightened(&["............", "####..###...", "....##...###", "............"]);
        assert_eq!(got, ["............", "############", "............", "............"]);
    }

    #[test]
    fn a_slanted_wall_becomes_steps_and_loses_nothing() {
        let size = 24;
        let rows: Vec<String> = (0..size)
            .map(|y| (0..size).map(|x| if x / 2 == y || x / 2 == y + 1 { '#' } else { '.' }).collect())
            .collect();
        let rows: Vec<&str> = rows.iter().map(String::as_str).collect();
        let got = straightened(&rows);
        let near = |rows: &[String], x: usize, y: usize| {
            (y.saturating_sub(2)..(y + 3).min(size))
                .any(|v| (x.saturating_sub(2)..(x + 3).min(size)).any(|u| rows[v].as_bytes()[u] == b'#'))
        };
        let rows: Vec<String> = rows.iter().map(|row| (*row).to_owned()).collect();
        for y in 0..size {
            for x in 0..size {
                assert!(rows[y].as_bytes()[x] != b'#' || near(&got, x, y), "{x}, {y} is lost: {got:#?}");
                assert!(got[y].as_bytes()[x] != b'#' || near(&rows, x, y), "{x}, {y} is new: {got:#?}");
            }
        }
    }
}
