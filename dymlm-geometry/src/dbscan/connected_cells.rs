use super::grid::Grid;
use super::touching_blocks::RowOffset;
use super::union_find::UnionFind;
use crate::parallel::{for_each, task_size};

/// Joins cells that hold points within eps of each other.
#[derive(Debug, Default)]
pub(super) struct ConnectedCells {
    joined: UnionFind,
    /// The root that all cells of a block have; [`NO_COMMON_ROOT`] when they differ or there is no point.
    common_roots: Vec<u32>,
    /// Which octants of each block are cells of the grid, a bit each.
    octants: Vec<u8>,
}

const NO_COMMON_ROOT: u32 = u32::MAX;

/// How far two cells lie apart: the greatest difference of their indices. Cells farther apart hold no points
/// within eps of each other.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Distance {
    Adjacent,
    TwoApart,
}

impl ConnectedCells {
    /// Joins all cells that hold a pair of points, one each, within eps. The grid holds core points only.
    ///
    /// Adjacent cells come first. Most blocks are joined after that, each in itself and with the blocks that
    /// touch it, and their common root shows this at once; so only few blocks have to be searched for near
    /// pairs in cells two apart.
    pub(super) fn join(&mut self, grid: &Grid, squared_eps: f32) {
        self.joined.reset(grid.cell_count());
        self.common_roots.clear();
        self.common_roots.resize(grid.block_count(), NO_COMMON_ROOT);
        self.octants.clear();
        self.octants.extend((0..grid.block_count()).map(|block| octants_of(grid, block)));
        self.join_at(Distance::Adjacent, grid, squared_eps);
        self.joined.flatten();
        self.find_common_roots(grid);
        self.join_at(Distance::TwoApart, grid, squared_eps);
        self.joined.flatten();
    }

    /// The first of the cells that a cell is connected to.
    #[inline]
    pub(super) fn root(&self, cell: usize) -> usize {
        self.joined.root(cell)
    }

    fn find_common_roots(&mut self, grid: &Grid) {
        for (block, common) in self.common_roots.iter_mut().enumerate() {
            let mut roots = grid.cells_of_blocks(block..block + 1).map(|cell| self.joined.root(cell) as u32);
            if let Some(first) = roots.next()
                && roots.all(|root| root == first)
            {
                *common = first;
            }
        }
    }

    fn join_at(&self, distance: Distance, grid: &Grid, squared_eps: f32) {
        let blocks = grid.block_count();
        let share = task_size(blocks);
        let tasks = (0..blocks).step_by(share).map(|first| first..(first + share).min(blocks));
        for_each(tasks, |blocks| {
            for block in blocks {
                self.join_block(distance, grid, squared_eps, block);
            }
        });
    }

    /// Joins the cells of a block with each other and with those of the blocks after it.
    fn join_block(&self, distance: Distance, grid: &Grid, squared_eps: f32, block: usize) {
        if grid.cells_of_blocks(block..block + 1).is_empty() {
            return;
        }
        let join = |other: usize, offset: [i32; 3]| {
            let root = self.common_roots[block];
            if root == NO_COMMON_ROOT || root != self.common_roots[other] {
                self.join_blocks(distance, grid, squared_eps, [block, other], offset);
            }
        };
        if distance == Distance::Adjacent {
            join(block, [0; 3]);
        }
        let own_row = grid.touching(block, RowOffset::OWN);
        own_row.filter(|&other| other > block).for_each(|other| join(other, [0, 0, 1]));
        for row in RowOffset::AFTER {
            for other in grid.touching(block, row) {
                join(other, [row.x, row.y, grid.z_of_block(other) - grid.z_of_block(block)]);
            }
        }
    }

    /// Joins the cells of two blocks, of which the second lies at `offset` from the first.
    fn join_blocks(
        &self,
        distance: Distance,
        grid: &Grid,
        squared_eps: f32,
        blocks: [usize; 2],
        offset: [i32; 3],
    ) {
        let [own, others] = blocks.map(|block| grid.cells_of_blocks(block..block + 1));
        let pairs = &PAIRS[distance as usize][place(offset)];
        let present = self.octants[blocks[1]];
        for cell in own {
            let mut partners = pairs[usize::from(grid.octant_of_cell(cell))] & present;
            while partners != 0 {
                let octant = partners.trailing_zeros();
                partners &= partners - 1;
                // The cells of a block ascend by octant.
                let before = (present & ((1 << octant) - 1)).count_ones();
                self.join_cell(grid, squared_eps, cell, others.start + before as usize);
            }
        }
    }

    #[inline]
    fn join_cell(&self, grid: &Grid, squared_eps: f32, cell: usize, other: usize) {
        let run = |cell: usize| grid.run(cell..cell + 1);
        if self.joined.root(cell) != self.joined.root(other)
            && run(cell).any_pair_within(run(other), squared_eps)
        {
            self.joined.join(cell, other);
        }
    }
}

fn octants_of(grid: &Grid, block: usize) -> u8 {
    grid.cells_of_blocks(block..block + 1).fold(0, |octants, cell| octants | 1 << grid.octant_of_cell(cell))
}

/// For each distance, offset of the other block and octant of a cell: the octants of the other block, a bit
/// each, whose cells lie at that distance. Of two octants of one block only the later one counts.
const PAIRS: [[[u8; 8]; 27]; 2] = [pairs_at(1), pairs_at(2)];

const fn pairs_at(distance: i32) -> [[u8; 8]; 27] {
    let mut pairs = [[0; 8]; 27];
    let mut index = 0;
    while index < 27 * 64 {
        let (place, from, to) = (index / 64, index / 8 % 8, index % 8);
        let offset = [place as i32 / 9 - 1, place as i32 / 3 % 3 - 1, place as i32 % 3 - 1];
        let (mut axis, mut greatest) = (0, 0);
        while axis < 3 {
            let bit = 2 - axis;
            let apart = (2 * offset[axis] + (to >> bit & 1) as i32 - (from >> bit & 1) as i32).abs();
            greatest = if apart > greatest { apart } else { greatest };
            axis += 1;
        }
        let same_block = offset[0] == 0 && offset[1] == 0 && offset[2] == 0;
        if greatest == distance && !(same_block && to < from) {
            pairs[place][from] |= 1 << to;
        }
        index += 1;
    }
    pairs
}

/// Place of an offset, each coordinate -1, 0 or 1, in [`PAIRS`].
#[inline]
fn place([x, y, z]: [i32; 3]) -> usize {
    ((x + 1) * 9 + (y + 1) * 3 + z + 1) as usize
}
