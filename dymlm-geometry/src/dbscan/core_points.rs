use super::grid::Grid;
use super::large_counts::has_large_counts;
use super::touching_blocks::RowOffset;
use crate::box_tree::BoxTree;
use crate::parallel::{for_each, task_size};

/// Counts the neighbours of each slot, itself among them: a slot holds a core point when its count reaches
/// `min_points`; lower counts mean nothing.
pub(super) fn count_neighbors(grid: &Grid, squared_eps: f32, min_points: u32, neighbors: &mut Vec<u32>) {
    neighbors.clear();
    neighbors.resize(grid.slot_count(), 0);
    let mut rest = neighbors.as_mut_slice();
    let mut split_off = |blocks| {
        let slots = grid.slots_of_cells(grid.cells_of_blocks(blocks));
        let counts;
        (counts, rest) = std::mem::take(&mut rest).split_at_mut(slots.len());
        counts
    };
    // For a small `min_points` points are compared one by one, for a large one boxes of points.
    let tree = has_large_counts(min_points).then(|| BoxTree::new(grid.run(0..grid.cell_count()).points()));
    let blocks_per_task = task_size(grid.block_count());
    let tasks = (0..grid.block_count()).step_by(blocks_per_task).map(|first| {
        let blocks = first..(first + blocks_per_task).min(grid.block_count());
        (blocks.clone(), split_off(blocks))
    });
    for_each(tasks, |(blocks, counts)| {
        let mut rest = counts;
        let (mut front, mut next) = (Vec::new(), Vec::new());
        for block in blocks {
            let slots = grid.slots_of_cells(grid.cells_of_blocks(block..block + 1));
            let counts;
            (counts, rest) = std::mem::take(&mut rest).split_at_mut(slots.len());
            if settle_full_cells(grid, block, min_points, counts) {
                continue;
            }
            let Some(tree) = &tree else {
                count_in_block(grid, block, squared_eps, min_points, counts);
                continue;
            };
            if count_around(grid, block) < min_points as usize {
                continue;
            }
            let own = grid.run(grid.cells_of_blocks(block..block + 1));
            for (count, point) in
                counts.iter_mut().zip(own.points()).filter(|(count, _)| **count < min_points)
            {
                let is_core =
                    tree.has_within(point, squared_eps, min_points as usize, [&mut front, &mut next]);
                *count = if is_core { min_points } else { 0 };
            }
        }
    });
}

/// Number of points in the blocks that touch a block, itself among them.
fn count_around(grid: &Grid, block: usize) -> usize {
    let cells = RowOffset::ALL.into_iter().map(|row| grid.cells_of_blocks(grid.touching(block, row)));
    cells.map(|cells| grid.slots_of_cells(cells).len()).sum()
}

fn count_in_block(grid: &Grid, block: usize, squared_eps: f32, min_points: u32, counts: &mut [u32]) {
    let own = grid.run(grid.cells_of_blocks(block..block + 1));
    for row in RowOffset::ALL {
        let others = grid.run(grid.cells_of_blocks(grid.touching(block, row)));
        let mut settled = true;
        for (count, point) in counts.iter_mut().zip(own.points()) {
            if *count < min_points {
                *count += others.count_within(point, squared_eps, min_points - *count);
                settled &= *count >= min_points;
            }
        }
        if settled {
            return;
        }
    }
}

/// Settles cells of at least `min_points` points, which are all neighbours. Returns whether no other points
/// are left in the block.
fn settle_full_cells(grid: &Grid, block: usize, min_points: u32, counts: &mut [u32]) -> bool {
    let mut settled = true;
    let mut rest = counts;
    for cell in grid.cells_of_blocks(block..block + 1) {
        let counts;
        (counts, rest) = std::mem::take(&mut rest).split_at_mut(grid.slots_of_cells(cell..cell + 1).len());
        if counts.len() >= min_points as usize {
            counts.fill(min_points);
        } else {
            settled = false;
        }
    }
    settled
}
