/// A picture of cells, row by row.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct CellPicture {
    pub(super) width: usize,
    pub(super) height: usize,
    pub(super) cells: Vec<bool>,
}

/// A closed ring of cell corners; the first is not repeated. Outlines run counterclockwise (u right, v up),
/// holes clockwise.
pub(super) type Ring = Vec<[i64; 2]>;

impl CellPicture {
    fn at(&self, u: i64, v: i64) -> bool {
        u >= 0
            && v >= 0
            && (u as usize) < self.width
            && (v as usize) < self.height
            && self.cells[v as usize * self.width + u as usize]
    }

    /// Fills holes (empty cells that touch no border of the picture, joined by their sides and corners) of at
    /// most `largest` cells.
    pub(super) fn fill_holes(&mut self, largest: usize) {
        let mut seen = self.cells.clone();
        let mut hole = Vec::new();
        for start in 0..self.cells.len() {
            if seen[start] {
                continue;
            }
            seen[start] = true;
            hole.clear();
            hole.push(start);
            let mut open = false;
            let mut next = 0;
            while next < hole.len() {
                let (u, v) = (hole[next] % self.width, hole[next] / self.width);
                next += 1;
                open |= u == 0 || v == 0 || u + 1 == self.width || v + 1 == self.height;
                for dv in -1..=1_i64 {
                    for du in -1..=1_i64 {
                        let (u, v) = (u as i64 + du, v as i64 + dv);
                        let inside = u >= 0 && v >= 0 && u < self.width as i64 && v < self.height as i64;
                        if inside {
                            let cell = v as usize * self.width + u as usize;
                            if !seen[cell] {
                                seen[cell] = true;
                                hole.push(cell);
                            }
                        }
                    }
                }
            }
            if !open && hole.len() <= largest {
                for &cell in &hole {
                    self.cells[cell] = true;
                }
            }
        }
    }

    /// The rings around the filled cells: each side between a filled and an empty cell belongs to one ring,
    /// filled cells on its left.
    ///
    /// Where two filled cells touch at a corner only, the ring turns so that they stay apart. O(cells).
    pub(super) fn rings(&self) -> Vec<Ring> {
        // The side that leaves a corner rightwards is that below cell (u, v); each is walked once.
        let mut walked = vec![false; (self.width + 1) * (self.height + 1)];
        let mut rings = Vec::new();
        for v in 0..=self.height as i64 {
            for u in 0..self.width as i64 {
                // A lower side of a filled cell: the ring passes it to the right.
                let is_start = self.at(u, v) && !self.at(u, v - 1);
                if is_start && !walked[v as usize * (self.width + 1) + u as usize] {
                    rings.push(self.walk([u, v], &mut walked));
                }
            }
        }
        rings
    }

    /// Walks from a corner rightwards along the lower side of a filled cell, and back to it.
    fn walk(&self, start: [i64; 2], walked: &mut [bool]) -> Ring {
        const STEPS: [[i64; 2]; 4] = [[1, 0], [0, 1], [-1, 0], [0, -1]];
        let mut ring = Ring::new();
        let (mut corner, mut heading) = (start, 0_usize);
        loop {
            if heading == 0 {
                let index = corner[1] as usize * (self.width + 1) + corner[0] as usize;
                if walked[index] {
                    return ring;
                }
                walked[index] = true;
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
                // At a mere corner contact turn left: round the same cell.
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
    // Rings run along the axes: only upright sides cross a level ray, and no cell centre lies level with a
    // corner.
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
        let cells = rows.iter().flat_map(|row| row.bytes().map(|c| c == b'#')).collect();
        CellPicture { width: rows[0].len(), height: rows.len(), cells }
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
        assert_eq!(closed.cells.iter().filter(|&&cell| cell).count(), 12);
        closed.fill_holes(4);
        assert!(closed.cells.iter().all(|&cell| cell));
    }

    proptest::proptest! {
        /// The rings' areas add up to the cells, and every side between filled and empty is walked once.
        #[test]
        fn rings_enclose_the_cells(cells in proptest::collection::vec(proptest::bool::ANY, 48)) {
            let picture = CellPicture { width: 8, height: 6, cells };
            let rings = picture.rings();
            let filled = picture.cells.iter().filter(|&&cell| cell).count() as i64;
            proptest::prop_assert_eq!(rings.iter().map(|ring| doubled_area(ring)).sum::<i64>(), 2 * filled);
            for v in 0..6 {
                for u in 0..8 {
                    let inside = rings.iter().filter(|ring| contains(ring, [2 * u + 1, 2 * v + 1])).count();
                    proptest::prop_assert_eq!(inside % 2 == 1, picture.at(u, v));
                }
            }
        }
    }
}
