use std::ops::Range;

use super::grid::Grid;

/// How many rows lie within reach of a row along one axis, itself counted.
const SPAN: usize = 2 * Grid::REACH as usize + 1;

/// Walks the rows of a grid in order, and finds the rows around each: five cursors, one for each x, that only move
/// forward.
pub(super) struct NeighborRows<'a> {
    grid: &'a Grid,
    /// For each x, the first row that is not before (x, y - reach).
    cursors: [usize; SPAN],
    rows: [CellCursor; SPAN * SPAN],
}

/// A cursor into the cells of one neighbouring row, for a walk along the own row.
#[derive(Debug, Clone, Copy, Default)]
struct CellCursor {
    first: usize,
    end: usize,
}

impl<'a> NeighborRows<'a> {
    /// A walk that begins at some row.
    pub(super) fn starting_at(grid: &'a Grid, row: usize) -> Self {
        let from = grid.rows().get(row);
        let cursors = std::array::from_fn(|i| {
            from.map_or(0, |from| {
                let corner = (from.x + i as i32 - Grid::REACH, from.y - Grid::REACH);
                grid.rows().partition_point(|row| (row.x, row.y) < corner)
            })
        });
        Self { grid, cursors, rows: [CellCursor::default(); SPAN * SPAN] }
    }

    /// Goes to a row: the first one or a later one than before.
    pub(super) fn go_to(&mut self, row: usize) {
        let rows = self.grid.rows();
        let here = rows[row];
        self.rows = [CellCursor::default(); SPAN * SPAN];
        for (dx, cursor) in (-Grid::REACH..).zip(&mut self.cursors) {
            let x = here.x + dx;
            while rows.get(*cursor).is_some_and(|row| (row.x, row.y) < (x, here.y - Grid::REACH)) {
                *cursor += 1;
            }
            for (neighbor, row) in (*cursor..).zip(&rows[*cursor..]).take(SPAN) {
                if row.x != x || row.y > here.y + Grid::REACH {
                    break;
                }
                let cells = self.grid.cells_of_row(neighbor);
                self.rows[place(dx, row.y - here.y)] = CellCursor { first: cells.start, end: cells.end };
            }
        }
    }

    /// The cells of the neighbouring row at an offset whose z lies within `reach` of `z`; along a row, `z` ascends.
    #[inline]
    pub(super) fn cells(&mut self, [dx, dy]: [i32; 2], z: i32, reach: i32) -> Range<usize> {
        let cursor = &mut self.rows[place(dx, dy)];
        while cursor.first < cursor.end && self.grid.z_of_cell(cursor.first) < z - reach {
            cursor.first += 1;
        }
        let mut end = cursor.first;
        while end < cursor.end && self.grid.z_of_cell(end) <= z + reach {
            end += 1;
        }
        cursor.first..end
    }
}

#[inline]
fn place(dx: i32, dy: i32) -> usize {
    (dx + Grid::REACH) as usize * SPAN + (dy + Grid::REACH) as usize
}

/// Offsets of all neighbouring rows, the nearest first.
pub(super) const NEAREST_FIRST: [[i32; 2]; SPAN * SPAN] = [
    [0, 0],
    [0, -1],
    [0, 1],
    [-1, 0],
    [1, 0],
    [-1, -1],
    [-1, 1],
    [1, -1],
    [1, 1],
    [0, -2],
    [0, 2],
    [-2, 0],
    [2, 0],
    [-1, -2],
    [-1, 2],
    [1, -2],
    [1, 2],
    [-2, -1],
    [-2, 1],
    [2, -1],
    [2, 1],
    [-2, -2],
    [-2, 2],
    [2, -2],
    [2, 2],
];
