use super::distance::any_pair_within;
use super::grid::Grid;
use super::neighbor_rows::NeighborRows;
use super::union_find::UnionFind;
use crate::parallel::{for_each, task_size};

/// Offsets of the rows after a row, those beside it first.
const ROWS_AFTER: [[i32; 2]; 12] =
    [[0, 1], [1, 0], [1, -1], [1, 1], [0, 2], [2, 0], [1, -2], [1, 2], [2, -1], [2, 1], [2, -2], [2, 2]];
const ROWS_BESIDE: usize = 4;

/// Joins all cells that hold a pair of points, one each, within eps. The grid holds core points only.
///
/// Adjacent cells come first, and those two apart in a second round: most of them are joined by then, and to find that
/// out costs far less than to look for a near pair where there is none.
pub(super) fn join_cells(grid: &Grid, squared_eps: f32, joined: &mut UnionFind) {
    joined.reset(grid.cell_count());
    for reach in 1..=Grid::REACH {
        join_cells_up_to(grid, reach, squared_eps, joined);
        joined.flatten();
    }
}

fn join_cells_up_to(grid: &Grid, reach: i32, squared_eps: f32, joined: &UnionFind) {
    let rows = grid.rows().len();
    let rows_per_task = task_size(rows);
    let tasks = (0..rows).step_by(rows_per_task).map(|first| first..(first + rows_per_task).min(rows));
    for_each(tasks, |rows| {
        let mut around = NeighborRows::starting_at(grid, rows.start);
        for row in rows {
            around.go_to(row);
            for cell in grid.cells_of_row(row).filter(|&cell| !grid.point_indices(cell).is_empty()) {
                join_with_cells_after(grid, &mut around, row, cell, reach, squared_eps, joined);
            }
        }
    });
}

fn join_with_cells_after(
    grid: &Grid,
    around: &mut NeighborRows<'_>,
    row: usize,
    cell: usize,
    reach: i32,
    squared_eps: f32,
    joined: &UnionFind,
) {
    let own = grid.run(cell..cell + 1);
    let z = grid.z_of_cell(cell);
    let mut root = joined.root(cell);
    let mut join = |other: usize| {
        if joined.root(other) != root && any_pair_within(own, grid.run(other..other + 1), squared_eps) {
            joined.join(cell, other);
            root = joined.root(cell);
        }
    };
    let (adjacent, farther) = (reach == 1, reach > 1);
    for other in
        (cell + 1..grid.cells_of_row(row).end).take_while(|&other| grid.z_of_cell(other) <= z + reach)
    {
        if adjacent || grid.z_of_cell(other) > z + 1 {
            join(other);
        }
    }
    for offset in &ROWS_AFTER[..ROWS_BESIDE] {
        for other in around.cells(*offset, z, reach) {
            if adjacent || grid.z_of_cell(other).abs_diff(z) > 1 {
                join(other);
            }
        }
    }
    for offset in ROWS_AFTER[ROWS_BESIDE..].iter().filter(|_| farther) {
        around.cells(*offset, z, reach).for_each(&mut join);
    }
}
