use dymlm_core::DepthImage;

/// Side of a tile, pixels: most blocks are settled by a few tiles.
const TILE: usize = 16;
/// Tiles along the side of a large tile.
const LARGE: usize = 4;

/// Nearest and farthest reading of each tile of 16x16 pixels, and of each large tile of 64x64.
#[derive(Debug, Clone, Default)]
pub(crate) struct DepthTiles {
    tiles: Tiles,
    large: Tiles,
    /// Of the image, pixels.
    width: f32,
    height: f32,
    /// By columns, of the rows of one tile.
    nearest: Vec<f32>,
    farthest: Vec<f32>,
}

#[derive(Debug, Clone, Default)]
struct Tiles {
    /// Side of a tile, pixels.
    side: f32,
    columns: usize,
    rows: usize,
    ranges: Vec<DepthRange>,
}

/// The readings of a tile or of several.
#[derive(Debug, Clone, Copy)]
pub(crate) struct DepthRange {
    /// Nearest reading; 0 when a pixel has no reading.
    pub(crate) nearest: f32,
    /// Farthest reading; 0 when there is none at all.
    pub(crate) farthest: f32,
}

impl DepthRange {
    const NOTHING: Self = Self { nearest: f32::INFINITY, farthest: 0.0 };

    #[inline]
    fn join(self, other: Self) -> Self {
        // Readings are numbers, so that this needs no more than two instructions, unlike `min` and `max`.
        Self {
            nearest: if other.nearest < self.nearest { other.nearest } else { self.nearest },
            farthest: if other.farthest > self.farthest { other.farthest } else { self.farthest },
        }
    }
}

impl DepthTiles {
    /// Computes the tiles of an image.
    pub(crate) fn build(&mut self, depth: &DepthImage) {
        (self.width, self.height) = (depth.width() as f32, depth.height() as f32);
        self.tiles.reset(depth.width(), depth.height(), TILE);
        self.large.reset(depth.width(), depth.height(), TILE * LARGE);
        // First by columns, which the processor compares several at a time, then those of each tile.
        let width = depth.width();
        let columns = self.tiles.columns;
        for (rows, tiles) in depth.data().chunks(TILE * width).zip(self.tiles.ranges.chunks_mut(columns)) {
            let nothing = DepthRange::NOTHING;
            self.nearest.clear();
            self.nearest.resize(width, nothing.nearest);
            self.farthest.clear();
            self.farthest.resize(width, nothing.farthest);
            for row in rows.chunks_exact(width) {
                for ((&z, nearest), farthest) in row.iter().zip(&mut self.nearest).zip(&mut self.farthest) {
                    *nearest = if z < *nearest { z } else { *nearest };
                    *farthest = if z > *farthest { z } else { *farthest };
                }
            }
            let columns = self.nearest.chunks(TILE).zip(self.farthest.chunks(TILE));
            for (tile, (nearest, farthest)) in tiles.iter_mut().zip(columns) {
                let ranges = nearest.iter().zip(farthest);
                let ranges = ranges.map(|(&nearest, &farthest)| DepthRange { nearest, farthest });
                *tile = ranges.fold(nothing, DepthRange::join);
            }
        }
        for (index, &range) in self.tiles.ranges.iter().enumerate() {
            let (column, row) = (index % columns, index / columns);
            let large = &mut self.large.ranges[row / LARGE * self.large.columns + column / LARGE];
            *large = large.join(range);
        }
    }

    /// The range of the readings in all tiles that touch the pixels [left, right] x [top, bottom]; `None`
    /// when there are no such pixels. Outside the image there is no reading.
    pub(crate) fn range(&self, columns: [f32; 2], rows: [f32; 2]) -> Option<DepthRange> {
        self.range_of(&self.tiles, columns, rows)
    }

    /// As [`range`](Self::range), but of many pixels by large tiles, so that the range may be wider.
    pub(crate) fn rough_range(&self, columns: [f32; 2], rows: [f32; 2]) -> Option<DepthRange> {
        let is_large = [columns, rows].iter().all(|[first, last]| last - first > self.large.side);
        self.range_of(if is_large { &self.large } else { &self.tiles }, columns, rows)
    }

    fn range_of(&self, tiles: &Tiles, columns: [f32; 2], rows: [f32; 2]) -> Option<DepthRange> {
        let range = tiles.range(columns, rows)?;
        // By pixels, not by tiles: the last tiles may reach beyond the image.
        let is_inside = |[first, last]: [f32; 2], size: f32| first >= -0.5 && last < size - 0.5;
        let has_all = is_inside(columns, self.width) && is_inside(rows, self.height);
        Some(if has_all { range } else { DepthRange { nearest: 0.0, ..range } })
    }
}

impl Tiles {
    fn reset(&mut self, width: usize, height: usize, side: usize) {
        (self.columns, self.rows) = (width.div_ceil(side), height.div_ceil(side));
        self.side = side as f32;
        self.ranges.clear();
        self.ranges.resize(self.columns * self.rows, DepthRange::NOTHING);
    }

    /// The range of the readings in all tiles that touch the pixels.
    fn range(&self, [left, right]: [f32; 2], [top, bottom]: [f32; 2]) -> Option<DepthRange> {
        let tile_of = |pixel: f32| ((pixel + 0.5) / self.side).floor();
        let (first_column, last_column) = (tile_of(left), tile_of(right));
        let (first_row, last_row) = (tile_of(top), tile_of(bottom));
        let (columns, rows) = (self.columns as f32, self.rows as f32);
        if last_column < 0.0 || last_row < 0.0 || first_column >= columns || first_row >= rows {
            return None;
        }
        let mut range = DepthRange::NOTHING;
        let columns = first_column.max(0.0) as usize..=(last_column as usize).min(self.columns - 1);
        for row in first_row.max(0.0) as usize..=(last_row as usize).min(self.rows - 1) {
            let tiles = &self.ranges[row * self.columns..][..self.columns];
            range = tiles[columns.clone()].iter().fold(range, |range, &tile| range.join(tile));
        }
        Some(range)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_hold_the_extremes_of_their_pixels() {
        let mut data = vec![2.0; 40 * 20];
        data[3] = 0.5;
        data[39] = 0.0;
        let mut tiles = DepthTiles::default();
        tiles.build(&DepthImage::new(40, 20, data).unwrap());
        let range = |left, right| tiles.range([left, right], [0.0, 3.0]).unwrap();
        assert_eq!((range(0.0, 15.0).nearest, range(0.0, 15.0).farthest), (0.5, 2.0));
        assert_eq!(range(16.0, 31.0).nearest, 2.0);
        // A pixel without a reading, and a footprint that leaves the image.
        assert_eq!(range(16.0, 33.0).nearest, 0.0);
        assert_eq!(range(-9.0, 1.0).nearest, 0.0);
        assert!(tiles.range([-30.0, -1.0], [0.0, 3.0]).is_none());
        assert!(tiles.range([48.0, 60.0], [0.0, 3.0]).is_none());
        let wide = DepthImage::new(200, 80, (0..200 * 80).map(|pixel| 1.0 + pixel as f32).collect()).unwrap();
        tiles.build(&wide);
        let rough = tiles.rough_range([70.0, 140.0], [0.0, 66.0]).unwrap();
        assert_eq!((rough.nearest, rough.farthest), (65.0, 1.0 + 79.0 * 200.0 + 191.0));
        // The last tile reaches beyond the image.
        assert_eq!(tiles.range([150.0, 199.0], [3.0, 9.0]).unwrap().nearest, 145.0);
        assert_eq!(tiles.range([150.0, 205.0], [3.0, 9.0]).unwrap().nearest, 0.0);
    }
}
