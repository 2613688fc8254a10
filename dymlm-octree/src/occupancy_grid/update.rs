use super::OccupancyGrid;
use super::grid::{HeightRange, Heights, NO_HEIGHTS, cell_count};
use super::region::{GridCells, GridRegion, Shadow};
use crate::{Error, Extent, Octree};

/// What an update of a grid has done.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct GridUpdate {
    /// Number of cells that were projected again.
    pub projected: usize,
    /// Number of cells whose state has changed.
    pub changed: usize,
    /// First and last index along x and y of a rectangle around the changed cells, as
    /// `map_msgs/OccupancyGridUpdate` carries; `None` when none has changed.
    pub bounds: Option<[[usize; 2]; 2]>,
    /// Whether the grid has grown, so that the indices of its cells differ from before.
    pub has_grown: bool,
}

impl OccupancyGrid {
    /// Brings the grid up to date in place, given the cubes in which the octree has changed since
    /// ([`Octree::changes_since`]): each cell becomes what a new projection gives. A grid of
    /// [`Octree::project`] grows to where something new was observed, and never shrinks; other grids keep
    /// their region.
    ///
    /// O(cells over the cubes x leaves in a column); when the grid grows, its cells are copied too.
    ///
    /// # Errors
    ///
    /// [`Error::GridResolution`] when the octree's cells have another size; [`Error::Inflated`] for a grid of
    /// [`Self::inflated`]; [`Error::GridSize`]. The grid stays as it was.
    ///
    /// ```
    /// use dymlm_octree::{CellState, Octree, OctreeConfig};
    ///
    /// let mut map = Octree::new(OctreeConfig::default())?;
    /// map.insert_scan([0.0, 0.0, 1.01], &[[2.0, 0.01, 1.01]])?;
    /// let mut grid = map.project([0.0, 0.0, 1.0], 0.1, 1.8)?;
    ///
    /// let earlier = map.clone();
    /// map.insert_scan([0.0, 0.0, 1.01], &[[0.01, 1.0, 1.01]])?;
    /// let update = grid.update(&map, &map.changes_since(&earlier))?;
    /// assert!(update.has_grown && update.changed > 10);
    /// assert_eq!(grid.cells(), map.project([0.0, 0.0, 1.0], 0.1, 1.8)?.cells());
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn update(&mut self, map: &Octree, changes: &[Extent]) -> Result<GridUpdate, Error> {
        self.check_updatable(map)?;
        let has_grown = match self.heights {
            Heights::Same { range, grows: true } => {
                self.reach_out(map.region_of(self.axes, range, changes).as_ref())?
            }
            _ => false,
        };
        let mut indices = Vec::new();
        self.push_cells_over(changes, &mut indices);
        Ok(self.project_again(map, indices, has_grown))
    }

    /// [`Self::update`] for a grid of [`Octree::project_between`] whose heights may have changed too: all
    /// cells get their new heights, and cells whose heights have changed are projected again as well. With a
    /// `region` the grid grows to hold it too. A grid of [`Octree::project`] gets heights for each cell.
    ///
    /// O(cells) for the calls of `heights`, besides the cost of [`Self::update`].
    ///
    /// # Errors
    ///
    /// As [`Self::update`]; [`Error::GridRegion`].
    pub fn update_between(
        &mut self,
        map: &Octree,
        changes: &[Extent],
        region: Option<&GridRegion>,
        heights: impl Fn([f64; 2]) -> Option<[f64; 2]>,
    ) -> Result<GridUpdate, Error> {
        self.check_updatable(map)?;
        region.map_or(Ok(()), GridRegion::check)?;
        self.give_heights_by_cell(region)?;
        let has_grown = self.reach_out(region)?;
        let mut indices = Vec::new();
        self.push_cells_over(changes, &mut indices);
        let old = std::mem::replace(&mut self.heights, Heights::by_cell(Vec::new()));
        let mut ranges = Vec::with_capacity(self.cells.len());
        for index in 0..self.cells.len() {
            let range = heights(self.center_of(index)).unwrap_or(NO_HEIGHTS);
            if !is_same(old.of(index), range) {
                indices.push(index);
            }
            ranges.push(range);
        }
        self.heights = Heights::by_cell(ranges);
        Ok(self.project_again(map, indices, has_grown))
    }

    fn check_updatable(&self, map: &Octree) -> Result<(), Error> {
        if self.is_inflated {
            return Err(Error::Inflated);
        }
        if map.resolution() == self.resolution {
            return Ok(());
        }
        Err(Error::GridResolution { resolution: self.resolution, other: map.resolution() })
    }

    /// Gives each cell of a grid of the same heights these as its own, if the grid is to grow: new cells have
    /// none yet then, and are projected whatever heights they get.
    fn give_heights_by_cell(&mut self, region: Option<&GridRegion>) -> Result<(), Error> {
        let (Some(region), Heights::Same { range, .. }) = (region, &self.heights) else { return Ok(()) };
        // A grid that cannot grow so far stays as it was.
        cell_count(self.place_with(region))?;
        self.heights = Heights::by_cell(vec![*range; self.cells.len()]);
        Ok(())
    }

    fn place_with(&self, region: &GridRegion) -> GridCells {
        self.place.united(&GridCells::of(region, self.resolution))
    }

    /// Grows the grid to hold a region; whether it has grown.
    fn reach_out(&mut self, region: Option<&GridRegion>) -> Result<bool, Error> {
        let Some(region) = region else { return Ok(false) };
        let place = self.place_with(region);
        let has_grown = place != self.place;
        self.grow(place)?;
        Ok(has_grown)
    }

    /// Adds the indices of the cells whose columns may pass through the cubes.
    fn push_cells_over(&self, cubes: &[Extent], indices: &mut Vec<usize>) {
        let (width, height) = (self.width(), self.height());
        if width == 0 {
            return;
        }
        let between = self.heights.all();
        let shadows = cubes.iter().map(|cube| Shadow::of_box(cube, self.axes));
        let near = shadows.filter(|shadow| shadow.is_between(between));
        // Cubes above each other cover the same cells.
        let mut rectangles: Vec<[[usize; 2]; 2]> =
            near.map(|shadow| self.cells_in(&shadow.region())).collect();
        rectangles.sort_unstable();
        rectangles.dedup();
        for [[x_first, x_end], [y_first, y_end]] in rectangles {
            for y in y_first..y_end.min(height) {
                indices.extend((x_first..x_end.min(width)).map(|x| y * width + x));
            }
        }
    }

    /// Ranges of indices along x and y of the cells whose centres are in a region or 1e-3 cells beside it:
    /// rounding may move a column slightly.
    fn cells_in(&self, region: &GridRegion) -> [[usize; 2]; 2] {
        [0, 1].map(|axis| {
            let index = |c: f64| c / self.resolution - 0.5 - self.place.first[axis] as f64;
            let first = (index(region.min[axis]) - 1e-3).ceil().max(0.0);
            let end = (index(region.max[axis]) + 1e-3).floor() + 1.0;
            [first as usize, end.max(0.0) as usize]
        })
    }

    fn project_again(&mut self, map: &Octree, mut indices: Vec<usize>, has_grown: bool) -> GridUpdate {
        indices.sort_unstable();
        indices.dedup();
        let mut update = GridUpdate { projected: indices.len(), has_grown, ..GridUpdate::default() };
        let (mut accessor, width) = (map.accessor(), self.width().max(1));
        for index in indices {
            let state = self.projected(&mut accessor, index);
            if let Some(cell) = self.cells.get_mut(index).filter(|cell| **cell != state) {
                *cell = state;
                update.add([index % width, index / width]);
            }
        }
        update
    }
}

impl GridUpdate {
    fn add(&mut self, [x, y]: [usize; 2]) {
        self.changed += 1;
        let [xs, ys] = self.bounds.get_or_insert([[x, x], [y, y]]);
        *xs = [xs[0].min(x), xs[1].max(x)];
        *ys = [ys[0].min(y), ys[1].max(y)];
    }
}

/// Whether two ranges are equal; ranges with NaN are, since nothing counts in them.
fn is_same(one: HeightRange, other: HeightRange) -> bool {
    one == other || (one.iter().any(|c| c.is_nan()) && other.iter().any(|c| c.is_nan()))
}
