use dymlm_core::Pose;

use super::region::{GridCells, GridRegion};
use crate::{CellState, Error};

/// A 2D map seen from above, as ROS `map_server` reads it: what is in the way of a robot of a certain height.
///
/// The grid lies in the plane of its own x and y axes; its z axis is "up". Cells are square, row by row from
/// the lowest y, x running fastest.
#[derive(Debug, Clone, PartialEq)]
pub struct OccupancyGrid {
    /// Which cells of the plane the grid has.
    pub(super) place: GridCells,
    pub(super) resolution: f64,
    pub(super) axes: [[f64; 3]; 3],
    pub(super) world_from_grid: Pose,
    pub(super) cells: Vec<CellState>,
    pub(super) heights: Heights,
    /// Whether obstacles have a margin: an update would project cells anew, without theirs.
    pub(super) is_inflated: bool,
}

/// Lowest and highest height that count, along up from the world's origin, metres.
pub(super) type HeightRange = [f64; 2];

/// Between which heights cells are projected.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Heights {
    /// The same heights for all cells, and whether the grid grows to where something is observed between
    /// them.
    Same { range: HeightRange, grows: bool },
    /// Heights for each cell, NaN where nothing counts, and the lowest and the highest of all.
    ByCell { ranges: Vec<HeightRange>, all: HeightRange },
}

impl Heights {
    pub(super) fn by_cell(ranges: Vec<HeightRange>) -> Self {
        // `min` and `max` ignore NaN.
        let all = ranges.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |all, range| {
            [all[0].min(range[0]), all[1].max(range[1])]
        });
        Self::ByCell { ranges, all }
    }

    pub(super) fn of(&self, index: usize) -> HeightRange {
        match self {
            Self::Same { range, .. } => *range,
            Self::ByCell { ranges, .. } => ranges.get(index).copied().unwrap_or(NO_HEIGHTS),
        }
    }

    /// The lowest and the highest height of all cells.
    pub(super) fn all(&self) -> HeightRange {
        match self {
            Self::Same { range, .. } => *range,
            Self::ByCell { all, .. } => *all,
        }
    }
}

/// The heights of a cell for which none were given.
pub(super) const NO_HEIGHTS: HeightRange = [f64::NAN; 2];

impl OccupancyGrid {
    /// Largest number of cells.
    pub const MAX_CELLS: u64 = 1 << 28;

    /// A grid of unknown cells over a region, its lines at multiples of the cell size.
    pub(super) fn over(
        place: GridCells,
        resolution: f64,
        (axes, world_from_grid): ([[f64; 3]; 3], Pose),
        heights: Heights,
    ) -> Result<Self, Error> {
        let cells = vec![CellState::Unknown; cell_count(place)?];
        Ok(Self { place, resolution, axes, world_from_grid, cells, heights, is_inflated: false })
    }

    /// Grows the grid to more of the plane: new cells are unknown, and no heights are given for them yet.
    pub(super) fn grow(&mut self, place: GridCells) -> Result<(), Error> {
        if place == self.place {
            return Ok(());
        }
        let count = cell_count(place)?;
        let [old_width, width] = [self.width(), place.size()[0] as usize];
        // The first index of an empty grid means nothing, and may be any number.
        let [old, new] = [self.place.first, place.first];
        let [x, y] = [0, 1].map(|axis| old[axis].saturating_sub(new[axis]).max(0) as usize);
        self.cells = moved(&self.cells, old_width, CellState::Unknown, count, width, [x, y]);
        if let Heights::ByCell { ranges, .. } = &mut self.heights {
            *ranges = moved(ranges, old_width, NO_HEIGHTS, count, width, [x, y]);
        }
        self.place = place;
        Ok(())
    }

    /// The part of the grid that a region touches, cell by cell as it is here; cells of the region that the grid
    /// does not have are unknown.
    ///
    /// An [update](Self::update) brings only what has changed: it does not fill in cells that the grid did not
    /// have before it was cropped.
    ///
    /// An [inflated](Self::inflated) grid of a region lacks the margins of obstacles outside of it: make the grid
    /// of a region that is larger by the radius, inflate that, and crop it.
    ///
    /// # Errors
    ///
    /// [`Error::GridRegion`] when the region ends before it begins or is not finite; [`Error::GridSize`].
    ///
    /// ```
    /// use dymlm_octree::{CellState, GridRegion, Octree, OctreeConfig};
    ///
    /// let mut map = Octree::new(OctreeConfig::default())?;
    /// map.insert_scan([0.0, 0.0, 1.01], &[[2.0, 0.01, 1.01]])?;
    /// let before = GridRegion { min: [1.5, 0.0], max: [1.95, 0.05] };
    /// let wide = GridRegion { min: [1.3, -0.2], max: [2.15, 0.25] };
    /// let grid = map.project_region([0.0, 0.0, 1.0], 0.1, 1.8, &wide)?.inflated(0.2)?.cropped(&before)?;
    /// assert_eq!((grid.width(), grid.height()), (9, 1));
    /// assert_eq!(grid.at(8, 0), CellState::Occupied);
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn cropped(&self, region: &GridRegion) -> Result<Self, Error> {
        region.check()?;
        let place = GridCells::of(region, self.resolution);
        let cells = self.part(&self.cells, place, CellState::Unknown)?;
        let heights = match &self.heights {
            Heights::Same { range, .. } => Heights::Same { range: *range, grows: false },
            Heights::ByCell { ranges, .. } => Heights::by_cell(self.part(ranges, place, NO_HEIGHTS)?),
        };
        Ok(Self { place, cells, heights, ..*self })
    }

    /// What `all` has of the cells of another place; `other` where it has none.
    fn part<T: Copy>(&self, all: &[T], place: GridCells, other: T) -> Result<Vec<T>, Error> {
        let count = cell_count(place)?;
        let width = place.size()[0] as i64;
        let cell = |index: i64| {
            let [x, y] = [0, 1].map(|axis| {
                let within = if axis == 0 { index % width } else { index / width };
                let own = (place.first[axis] + within).checked_sub(self.place.first[axis])?;
                usize::try_from(own).ok().filter(|&own| own < self.place.size()[axis] as usize)
            });
            all.get(y? * self.width() + x?).copied()
        };
        Ok((0..count as i64).map(|index| cell(index).unwrap_or(other)).collect())
    }

    /// Number of cells along x; 0 when nothing was observed between the heights.
    pub fn width(&self) -> usize {
        self.place.size()[0] as usize
    }

    /// Number of cells along y.
    pub fn height(&self) -> usize {
        self.place.size()[1] as usize
    }

    /// Side of a cell, metres.
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// The lower left corner of cell (0, 0) in the grid's axes, metres.
    pub fn origin(&self) -> [f64; 2] {
        self.place.first.map(|index| index as f64 * self.resolution)
    }

    /// The region that the grid covers, in its own axes.
    pub fn region(&self) -> GridRegion {
        GridRegion { min: self.origin(), max: self.place.end.map(|index| index as f64 * self.resolution) }
    }

    /// The pose of the grid's axes in the world.
    pub fn world_from_grid(&self) -> Pose {
        self.world_from_grid
    }

    /// All cells, row by row from the lowest y.
    pub fn cells(&self) -> &[CellState] {
        &self.cells
    }

    /// A cell; unknown outside the grid.
    pub fn at(&self, x: usize, y: usize) -> CellState {
        if x < self.width() {
            self.cells.get(y * self.width() + x).copied().unwrap_or(CellState::Unknown)
        } else {
            CellState::Unknown
        }
    }

    /// Indices along x and y of the cell that holds a point in the grid's axes, metres; `None` outside and
    /// for NaN.
    pub fn cell_of(&self, point: [f64; 2]) -> Option<[usize; 2]> {
        let [x, y] = [0, 1].map(|axis| {
            let index = (point[axis] / self.resolution).floor() - self.place.first[axis] as f64;
            // NaN fails.
            (index >= 0.0 && index < self.place.size()[axis] as f64).then_some(index as usize)
        });
        Some([x?, y?])
    }

    /// Centre of a cell in the grid's axes, metres.
    pub fn center(&self, x: usize, y: usize) -> [f64; 2] {
        let [first_x, first_y] = self.place.first;
        [(x, first_x), (y, first_y)].map(|(i, first)| (first as f64 + i as f64 + 0.5) * self.resolution)
    }
}

pub(super) fn cell_count(place: GridCells) -> Result<usize, Error> {
    let [width, height] = place.size();
    let count = width.checked_mul(height).filter(|&count| count <= OccupancyGrid::MAX_CELLS);
    count.map(|count| count as usize).ok_or(Error::GridSize { width, height })
}

/// The cells `old` as a part, from (x, y) on, of a larger grid whose remaining cells are `other`.
fn moved<T: Copy>(
    old: &[T],
    old_width: usize,
    other: T,
    count: usize,
    width: usize,
    [x, y]: [usize; 2],
) -> Vec<T> {
    let mut cells = vec![other; count];
    if old_width > 0 {
        let rows = cells.chunks_exact_mut(width).skip(y);
        for (row, old) in rows.zip(old.chunks_exact(old_width)) {
            if let Some(within) = row.get_mut(x..x + old_width) {
                within.copy_from_slice(old);
            }
        }
    }
    cells
}
