use std::collections::BTreeMap;
use std::ops::Range;

use crate::patches::PatchVoxel;
use crate::plane_frame::PlaneFrame;

/// Least weight of a filled cell, as a share of the mean weight of the non-empty cells around it. At a
/// straight edge, where a third of these cells are rim cells themselves, this is half the weight of inner
/// cells.
const FILLED_SHARE: f32 = 0.6;
/// Number of cells on each side of a cell that count as around it.
const AROUND: i64 = 2;

/// Cells along the side of a tile.
pub(super) const TILE: i64 = 32;
const SIDE: usize = TILE as usize;
/// Side of a tile with the cells that count around it.
const WIDE: usize = SIDE + 2 * AROUND as usize;

/// The square cells of a plane, as large as voxels, with the weight of the samples in them.
///
/// A cell through which the rim passes holds fewer samples than inner cells do. So the samples of each voxel
/// are shared out to the four nearest cells, and a cell is filled when it is at least half full.
#[derive(Debug, Clone, Default)]
pub(crate) struct FilledCells {
    /// Weights of cells; tiles are sorted by row, then column.
    tiles: BTreeMap<[i64; 2], Box<[[f32; SIDE]; SIDE]>>,
}

impl FilledCells {
    /// The cells of some voxels, given block by block.
    pub(crate) fn new<V: Iterator<Item = PatchVoxel>>(
        blocks: impl Iterator<Item = V>,
        voxel_size: f64,
        frame: PlaneFrame,
    ) -> Self {
        let (mut cells, mut shares) = (Self::default(), Vec::new());
        for voxels in blocks {
            shares.clear();
            for voxel in voxels {
                let at = frame.to_plane(voxel.center(voxel_size)).map(|x| x / voxel_size - 0.5);
                let first = at.map(f64::floor);
                let part = [at[0] - first[0], at[1] - first[1]];
                for (du, of_u) in [(0, 1.0 - part[0]), (1, part[0])] {
                    for (dv, of_v) in [(0, 1.0 - part[1]), (1, part[1])] {
                        let weight = f64::from(voxel.count) * of_u * of_v;
                        shares.push(([first[0] as i64 + du, first[1] as i64 + dv], weight as f32));
                    }
                }
            }
            // The cells of a block lie in few tiles.
            shares.sort_by_key(|([u, v], _)| [v.div_euclid(TILE), u.div_euclid(TILE)]);
            for in_tile in shares
                .chunk_by(|(a, _), (b, _)| a.map(|c| c.div_euclid(TILE)) == b.map(|c| c.div_euclid(TILE)))
            {
                let tile = in_tile[0].0.map(|c| c.div_euclid(TILE));
                let tile = cells.tiles.entry([tile[1], tile[0]]);
                let tile = tile.or_insert_with(|| Box::new([[0.0; SIDE]; SIDE]));
                for ([u, v], weight) in in_tile {
                    tile[v.rem_euclid(TILE) as usize][u.rem_euclid(TILE) as usize] += weight;
                }
            }
        }
        cells
    }

    /// Calls `visit` for each filled cell (u, v), tile by tile.
    pub(super) fn visit(&self, mut visit: impl FnMut([i64; 2])) {
        for &[row, column] in self.tiles.keys() {
            let wide = self.with_rim([row, column]);
            for v in 0..SIDE {
                for u in 0..SIDE {
                    let own = wide[v + AROUND as usize][u + AROUND as usize];
                    let around = || wide[v..].iter().take(5).flat_map(|row| row[u..].iter().take(5));
                    let is_filled = own > 0.0 && {
                        let cells = around().filter(|weight| **weight > 0.0).count();
                        own * cells as f32 >= FILLED_SHARE * around().sum::<f32>() || goes_on(&wide, [u, v])
                    };
                    if is_filled {
                        visit([column * TILE + u as i64, row * TILE + v as i64]);
                    }
                }
            }
        }
    }

    /// A tile's weights with those of the cells around it.
    fn with_rim(&self, [row, column]: [i64; 2]) -> [[f32; WIDE]; WIDE] {
        let mut wide = [[0.0; WIDE]; WIDE];
        for (near, of_rows) in [(row - 1, 0), (row, 1), (row + 1, 2)] {
            for (beside, of_columns) in [(column - 1, 0), (column, 1), (column + 1, 2)] {
                let Some(tile) = self.tiles.get(&[near, beside]) else { continue };
                let (rows, from_row) = part_of(of_rows);
                let (columns, from_column) = part_of(of_columns);
                let into = wide[rows.clone()].iter_mut().zip(&tile[from_row..]);
                into.for_each(|(wide, tile)| {
                    wide[columns.clone()].copy_from_slice(&tile[from_column..][..columns.len()]);
                });
            }
        }
        wide
    }
}

/// Whether the plane goes on as densely beyond a cell, on any of its sides: then what is denser on the other
/// side has been seen by more key frames, and the cell is no rim.
fn goes_on(wide: &[[f32; WIDE]; WIDE], [u, v]: [usize; 2]) -> bool {
    let (side, width) = (AROUND as usize, 2 * AROUND as usize + 1);
    let own = wide[v + side][u + side] * (side * width) as f32;
    let is_alike = |rows: Range<usize>, columns: Range<usize>| {
        let cells = || rows.clone().flat_map(|row| &wide[v + row][u + columns.start..u + columns.end]);
        cells().all(|weight| *weight > 0.0) && own >= FILLED_SHARE * cells().sum::<f32>()
    };
    let ends = [0..side, side + 1..width];
    ends.into_iter().any(|beyond| is_alike(0..width, beyond.clone()) || is_alike(beyond, 0..width))
}

/// For the previous tile (0), the tile itself (1) and the next tile (2): the range of the wide array that it
/// fills, and the first of its own rows or columns that goes there.
fn part_of(tile: usize) -> (Range<usize>, usize) {
    let around = AROUND as usize;
    match tile {
        0 => (0..around, SIDE - around),
        1 => (around..around + SIDE, 0),
        _ => (around + SIDE..WIDE, 0),
    }
}
