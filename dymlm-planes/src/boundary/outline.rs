use std::collections::BTreeMap;

use super::filled_cells::{FilledCells, TILE};

/// A picture of cells, stored in tiles because a plane may reach for kilometres.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct CellPicture {
    /// Sorted by row, then column of tiles; one bit per cell.
    tiles: BTreeMap<[i64; 2], [u32; TILE as usize]>,
}

/// A closed ring of cell corners; the first is not repeated. Outlines run counterclockwise (u right, v up),
/// holes clockwise.
pub(super) type Ring = Vec<[i64; 2]>;

impl CellPicture {
    /// The filled cells of a patch.
    pub(crate) fn of(cells: &FilledCells) -> Self {
        let mut picture = Self::default();
        cells.visit(|cell| picture.fill(cell));
        picture
    }

    fn place([u, v]: [i64; 2]) -> ([i64; 2], usize, u32) {
        ([v.div_euclid(TILE), u.div_euclid(TILE)], v.rem_euclid(TILE) as usize, 1 << u.rem_euclid(TILE))
    }

    fn fill(&mut self, cell: [i64; 2]) {
        let (tile, row, bit) = Self::place(cell);
        self.tiles.entry(tile).or_default()[row] |= bit;
    }

    fn at(&self, u: i64, v: i64) -> bool {
        let (tile, row, bit) = Self::place([u, v]);
        self.tiles.get(&tile).is_some_and(|tile| tile[row] & bit != 0)
    }

    /// Number of filled cells.
    pub(crate) fn len(&self) -> usize {
        self.tiles.values().flatten().map(|row| row.count_ones() as usize).sum()
    }

    /// The filled cells, tile by tile.
    fn cells(&self) -> impl Iterator<Item = [i64; 2]> {
        self.tiles.iter().flat_map(|(&[row, column], tile)| {
            let cells = (0..TILE).flat_map(|v| (0..TILE).map(move |u| [u, v]));
            let filled = cells.filter(|&[u, v]| tile[v as usize] & (1 << u) != 0);
            filled.map(move |[u, v]| [column * TILE + u, row * TILE + v])
        })
    }

    /// Fills holes of at most `largest` cells. A hole is a set of empty cells, joined by sides or corners,
    /// that filled cells surround.
    ///
    /// The search for a hole starts above each filled cell that has an empty cell there. Cells found to
    /// belong to too large an area are remembered, so that the outside is searched only once along its rim.
    pub(crate) fn fill_holes(&mut self, largest: usize) {
        let starts: Vec<[i64; 2]> =
            self.cells().map(|[u, v]| [u, v + 1]).filter(|&[u, v]| !self.at(u, v)).collect();
        let mut open = Self::default();
        for start in starts {
            if self.at(start[0], start[1]) || open.at(start[0], start[1]) {
                continue;
            }
            let (mut hole, mut seen, mut next) = (vec![start], Self::default(), 0);
            seen.fill(start);
            let mut is_open = false;
            while next < hole.len() && !is_open {
                let [u, v] = hole[next];
                next += 1;
                for [u, v] in (-1..=1).flat_map(|dv| (-1..=1).map(move |du| [u + du, v + dv])) {
                    if !self.at(u, v) && !seen.at(u, v) {
                        seen.fill([u, v]);
                        hole.push([u, v]);
                        is_open |= hole.len() > largest || open.at(u, v);
                    }
                }
            }
            let into = if is_open { &mut open } else { &mut *self };
            for cell in hole {
                into.fill(cell);
            }
        }
    }

    /// The rings around the filled cells: each side between a filled and an empty cell belongs to one ring,
    /// with the filled cell on its left.
    ///
    /// Where two filled cells touch only at a corner, they stay in separate rings. O(cells).
    pub(super) fn rings(&self) -> Vec<Ring> {
        // A side that runs right is stored as the cell above it; each is traced once.
        let mut walked = Self::default();
        let mut rings = Vec::new();
        for [u, v] in self.cells() {
            // The lower side of a filled cell, along which the ring runs right.
            if !self.at(u, v - 1) && !walked.at(u, v) {
                rings.push(self.walk([u, v], &mut walked));
            }
        }
        rings
    }

    /// Traces a ring from a corner, first rightwards along the lower side of a filled cell, until it returns
    /// there.
    fn walk(&self, start: [i64; 2], walked: &mut Self) -> Ring {
        const STEPS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];
        let mut ring = Ring::new();
        let (mut corner, mut heading) = (start, 0_usize);
        loop {
            if heading == 0 {
                if walked.at(corner[0], corner[1]) {
                    return ring;
                }
                walked.fill(corner);
            }
            let [du, dv] = STEPS[heading];
            corner = [corner[0] + du, corner[1] + dv];
            // The cells ahead, left and right of the heading.
            let [u, v] = corner;
            let (left, right) = match heading {
                0 => (self.at(u, v), self.at(u, v - 1)),
                1 => (self.at(u - 1, v), self.at(u, v)),
                2 => (self.at(u - 1, v - 1), self.at(u - 1, v)),
                _ => (self.at(u, v - 1), self.at(u - 1, v - 1)),
            };
            let turned = match (left, right) {
                // At a contact by a corner only, turn left, around the same cell.
                (false, _) => (heading + 1) % 4,
                (true, true) => (heading + 3) % 4,
                (true, false) => heading,
            };
            if turned != heading {
                ring.push(corner);
            }
            heading = turned;
        }
    }
}

/// Twice the signed area of a ring, positive counterclockwise.
pub(super) fn doubled_area(ring: &[[i64; 2]]) -> i64 {
    let next = ring.iter().cycle().skip(1);
    ring.iter().zip(next).map(|([a, b], [c, d])| a * d - b * c).sum()
}

/// Whether a point, given at doubled coordinates so that cell centres are whole, lies inside a ring (even-odd
/// rule).
pub(super) fn contains(ring: &[[i64; 2]], [u, v]: [i64; 2]) -> bool {
    let next = ring.iter().cycle().skip(1);
    // Rings run along the axes, so only vertical sides cross a horizontal ray; and no cell centre is level
    // with a corner.
    let crossings = ring.iter().zip(next).filter(|(a, b)| {
        let (low, high) = (2 * a[1].min(b[1]), 2 * a[1].max(b[1]));
        a[0] == b[0] && 2 * a[0] > u && (low..high).contains(&v)
    });
    crossings.count() % 2 == 1
}

#[cfg(test)]
mod tests {
    use super::*;

    fn picture(rows: &[&str]) -> CellPicture {
        let mut picture = CellPicture::default();
        for (row, v) in rows.iter().zip(0..) {
            row.bytes().zip(0..).filter(|(c, _)| *c == b'#').for_each(|(_, u)| picture.fill([u, v]));
        }
        picture
    }

    #[test]
    fn walks_round_cells_and_holes() {
        let rings = picture(&["###", "#.#", "###"]).rings();
        assert_eq!(rings.len(), 2);
        assert_eq!(rings[0].len(), 4);
        assert_eq!(rings.iter().map(|ring| doubled_area(ring)).collect::<Vec<_>>(), [18, -2]);
        assert!(contains(&rings[0], [3, 3]) && contains(&rings[1], [3, 3]) && !contains(&rings[1], [1, 1]));
    }

    #[test]
    fn cells_that_touch_at_a_corner_stay_apart() {
        for rows in [["#.", ".#"], [".#", "#."]] {
            let rings = picture(&rows).rings();
            assert_eq!(rings.iter().map(|ring| doubled_area(ring)).collect::<Vec<_>>(), [2, 2]);
        }
    }

    #[test]
    fn only_small_closed_holes_are_filled() {
        let rows = ["######", "#.##.#", "######", "#....#", "#....#", "####.#"];
        let mut filled = picture(&rows);
        filled.fill_holes(1);
        assert_eq!(filled, picture(&["######", "######", "######", "#....#", "#....#", "####.#"]));
        let mut closed = picture(&["####", "#..#", "#..#", "####"]);
        closed.fill_holes(3);
        assert_eq!(closed.len(), 12);
        closed.fill_holes(4);
        assert_eq!(closed.len(), 16);
    }

    proptest::proptest! {
        /// The rings' areas add up to the cells' area, and every side between filled and empty is traced
        /// once.
        #[test]
        fn rings_enclose_the_cells(cells in proptest::collection::vec(proptest::bool::ANY, 48)) {
            let mut picture = CellPicture::default();
            // On the border of four tiles.
            let filled = cells.iter().zip(0..).filter(|(cell, _)| **cell);
            filled.for_each(|(_, k)| picture.fill([k % 8 - 4, k / 8 - 3]));
            let rings = picture.rings();
            let filled = picture.len() as i64;
            proptest::prop_assert_eq!(rings.iter().map(|ring| doubled_area(ring)).sum::<i64>(), 2 * filled);
            for v in -3..3 {
                for u in -4..4 {
                    let inside = rings.iter().filter(|ring| contains(ring, [2 * u + 1, 2 * v + 1])).count();
                    proptest::prop_assert_eq!(inside % 2 == 1, picture.at(u, v));
                }
            }
        }
    }
}
