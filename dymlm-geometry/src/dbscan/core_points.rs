use super::grid::Grid;
use super::neighbor_rows::{NEAREST_FIRST, NeighborRows};
use crate::parallel::{for_each, task_size};

/// Counts the neighbours of each slot, itself among them, and stops where `min_points` is reached: a slot holds a core
/// point when its count reaches `min_points`.
pub(super) fn count_neighbors(grid: &Grid, squared_eps: f32, min_points: u32, neighbors: &mut Vec<u32>) {
    neighbors.clear();
    neighbors.resize(grid.slot_count(), 0);
    let rows = grid.rows().len();
    let rows_per_task = task_size(rows);
    let mut rest = neighbors.as_mut_slice();
    let tasks = (0..rows).step_by(rows_per_task).map(|first_row| {
        let end_row = (first_row + rows_per_task).min(rows);
        let cells = grid.cells_of_row(first_row).start..grid.cells_of_row(end_row - 1).end;
        let counts;
        (counts, rest) = std::mem::take(&mut rest).split_at_mut(grid.slots(cells).len());
        (first_row..end_row, counts)
    });
    for_each(tasks, |(rows, counts)| {
        let mut around = NeighborRows::starting_at(grid, rows.start);
        let mut rest = counts;
        for row in rows {
            around.go_to(row);
            for cell in grid.cells_of_row(row) {
                let own;
                (own, rest) = std::mem::take(&mut rest).split_at_mut(grid.point_indices(cell).len());
                count_in_cell(grid, &mut around, cell, squared_eps, min_points, own);
            }
        }
    });
}

fn count_in_cell(
    grid: &Grid,
    around: &mut NeighborRows<'_>,
    cell: usize,
    squared_eps: f32,
    min_points: u32,
    counts: &mut [u32],
) {
    if counts.len() >= min_points as usize {
        counts.fill(min_points);
        return;
    }
    let own = grid.run(cell..cell + 1);
    let z = grid.z_of_cell(cell);
    for offset in NEAREST_FIRST {
        let cells = around.cells(offset, z, Grid::REACH);
        let others = grid.run(cells);
        if others.len() == 0 {
            continue;
        }
        let mut open = false;
        for (slot, count) in counts.iter_mut().enumerate() {
            if *count < min_points {
                *count += others.count_within(own.point(slot), squared_eps);
                open |= *count < min_points;
            }
        }
        if !open {
            return;
        }
    }
}
