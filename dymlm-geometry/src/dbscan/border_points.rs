use dymlm_core::Point;

use super::clusters::NO_CLUSTER;
use super::grid::Grid;
use super::large_counts::has_large_counts;
use super::touching_blocks::RowOffset;
use crate::box_tree::LeastLabels;
use crate::parallel::{for_each, task_size};

/// The points that are no core points: border points and noise.
#[derive(Debug, Default)]
pub(super) struct BorderPoints {
    /// In the order of their blocks.
    points: Vec<BorderPoint>,
}

#[derive(Debug, Clone, Copy)]
struct BorderPoint {
    block: u32,
    /// Index into the cloud.
    point: u32,
    label: u32,
}

impl BorderPoints {
    /// Takes the points with fewer than `min_points` neighbours out of the grid, which keeps the core points.
    pub(super) fn take_from(&mut self, grid: &mut Grid, neighbors: &[u32], min_points: u32) {
        self.points.clear();
        grid.retain(
            |slot| neighbors[slot] >= min_points,
            |block, point| self.points.push(BorderPoint { block: block as u32, point, label: NO_CLUSTER }),
        );
    }

    /// Finds for each point the first cluster that has a core point within eps.
    pub(super) fn label(
        &mut self,
        grid: &Grid,
        label_of_cell: &[u32],
        squared_eps: f32,
        points: &[Point],
        min_points: u32,
    ) {
        // A cell holds fewer than `min_points` border points: only when that is many can comparing points one
        // by one take long.
        let tree = has_large_counts(min_points).then(|| {
            let labels = label_of_cell.iter().enumerate();
            let of_points =
                labels.flat_map(|(cell, &label)| vec![label; grid.slots_of_cells(cell..cell + 1).len()]);
            LeastLabels::new(grid.run(0..grid.cell_count()).points(), &of_points.collect::<Vec<_>>())
        });
        let share = task_size(self.points.len());
        for_each(self.points.chunks_mut(share), |share| {
            let mut open = Vec::new();
            for border in share {
                let point = points[border.point as usize];
                if let Some(tree) = &tree {
                    border.label = tree.within(point, squared_eps, &mut open);
                    continue;
                }
                border.label = first_label(grid, label_of_cell, border.block as usize, point, squared_eps);
            }
        });
    }

    /// Index into the cloud and cluster of each border point.
    pub(super) fn labels(&self) -> impl Iterator<Item = (usize, u32)> + '_ {
        self.points
            .iter()
            .filter(|border| border.label != NO_CLUSTER)
            .map(|border| (border.point as usize, border.label))
    }
}

/// The least label of the cells with a core point within eps; [`NO_CLUSTER`] is greater than all.
fn first_label(grid: &Grid, label_of_cell: &[u32], block: usize, point: Point, squared_eps: f32) -> u32 {
    let mut first = NO_CLUSTER;
    for row in RowOffset::ALL {
        let cells = grid.cells_of_blocks(grid.touching(block, row));
        if !grid.run(cells.clone()).any_within(point, squared_eps) {
            continue;
        }
        for cell in cells {
            let label = label_of_cell[cell];
            if label < first && grid.run(cell..cell + 1).any_within(point, squared_eps) {
                first = label;
            }
        }
    }
    first
}
