use super::raster::Raster;

/// A rectangle of free cells.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Tile {
    pub(super) low: [usize; 2],
    pub(super) high: [usize; 2],
}

/// Sides of the rectangles that are furnished, metres: smaller ones hold nothing but a way, larger ones are cut.
const SHORTEST: f64 = 2.2;
const LONGEST: f64 = 6.5;
/// Smallest area of a rectangle that is furnished, square metres.
const SMALLEST: f64 = 7.0;

/// Rectangles of free cells like rooms: the largest one first, cut where it is long, then the largest one of what
/// is left.
pub(super) fn tiles(free: &Raster, resolution: f64) -> Vec<Tile> {
    let mut left = free.clone();
    let shortest = (SHORTEST / resolution).ceil() as usize;
    let smallest = (SMALLEST / (resolution * resolution)).ceil() as usize;
    let mut tiles = Vec::new();
    while let Some(tile) = largest_rectangle(&left, shortest) {
        let [width, height] = tile.lengths();
        if width * height < smallest {
            break;
        }
        for y in tile.low[1]..tile.high[1] {
            left.cells[y * left.width + tile.low[0]..y * left.width + tile.high[0]].fill(false);
        }
        let longest = LONGEST / resolution;
        let parts = [width, height].map(|length| (length as f64 / longest).ceil() as usize);
        let cut = |axis: usize, k: usize| tile.low[axis] + tile.lengths()[axis] * k / parts[axis];
        for j in 0..parts[1] {
            tiles.extend(
                (0..parts[0])
                    .map(|i| Tile { low: [cut(0, i), cut(1, j)], high: [cut(0, i + 1), cut(1, j + 1)] }),
            );
        }
    }
    tiles
}

impl Tile {
    /// Numbers of cells along x and y.
    pub(super) fn lengths(&self) -> [usize; 2] {
        [self.high[0] - self.low[0], self.high[1] - self.low[1]]
    }
}

/// The largest rectangle of cells in the set with sides of at least `shortest` cells, the first of equals: for each
/// row, the largest one under the columns that stand on it, whose heights a stack keeps in rising order.
fn largest_rectangle(raster: &Raster, shortest: usize) -> Option<Tile> {
    let mut heights = vec![0_usize; raster.width + 1];
    let (mut best, mut most) = (None, 0);
    let mut rising: Vec<(usize, usize)> = Vec::new();
    for (y, row) in raster.cells.chunks(raster.width).enumerate() {
        for (height, &is_in) in heights.iter_mut().zip(row) {
            *height = if is_in { *height + 1 } else { 0 };
        }
        rising.clear();
        // The last height is 0: all rectangles end there.
        for (x, &height) in heights.iter().enumerate() {
            let mut begin = x;
            while let Some(&(from, tall)) = rising.last().filter(|(_, tall)| *tall >= height) {
                rising.pop();
                begin = from;
                if tall * (x - from) > most && tall >= shortest && x - from >= shortest {
                    most = tall * (x - from);
                    best = Some(Tile { low: [from, y + 1 - tall], high: [x, y + 1] });
                }
            }
            rising.push((begin, height));
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_rectangle_is_found() {
        let cells: Vec<u8> = ["..#...", "......", "......", "#....."].concat().into_bytes();
        let free = Raster::of(&cells, 6, |&cell| cell == b'.');
        let found = |shortest: usize| largest_rectangle(&free, shortest).map(|tile| (tile.low, tile.high));
        assert_eq!(found(1), Some(([1, 1], [6, 4])));
        assert_eq!(found(4), None);
        let full = Raster { width: 3, height: 2, cells: vec![true; 6] };
        assert_eq!(largest_rectangle(&full, 1), Some(Tile { low: [0, 0], high: [3, 2] }));
        let empty = Raster { width: 3, height: 2, cells: vec![false; 6] };
        assert_eq!(largest_rectangle(&empty, 1), None);
    }

    #[test]
    fn halls_are_cut_and_tiles_do_not_overlap() {
        let free = Raster { width: 200, height: 100, cells: vec![true; 20_000] };
        let tiles = tiles(&free, 0.1);
        let mut covered = vec![0_u8; 20_000];
        for tile in &tiles {
            assert!(tile.lengths().iter().all(|&length| length <= 65), "{tile:?}");
            for y in tile.low[1]..tile.high[1] {
                (tile.low[0]..tile.high[0]).for_each(|x| covered[y * 200 + x] += 1);
            }
        }
        assert_eq!(tiles.len(), 8);
        assert!(covered.iter().all(|&count| count == 1));
    }
}
