use std::cmp::Ordering;

use dymlm_core::Pose;

use super::OccupancyGrid;
use super::column::column_state;
use super::grid::{HeightRange, Heights, NO_HEIGHTS, cell_count};
use super::grid_axes::{grid_axes, world_from_grid};
use super::region::{GridCells, GridRegion, Shadow};
use crate::accessor::Accessor;
use crate::{CellState, Error, Extent, Leaf, Octree};

impl Octree {
    /// Projects the cells between two heights onto a 2D grid. Heights are measured along `up` (any length,
    /// any direction) from the world's origin, metres; infinite heights mean no limit.
    ///
    /// A grid cell is occupied when the line along `up` through its centre meets an occupied cell between the
    /// heights, else free when it meets a free one, else unknown. The grid's x and y axes are the world's
    /// after the smallest rotation that takes z to `up`; for `up` = z each grid cell is a column of octree
    /// cells. The grid reaches as far as something was observed between the heights.
    ///
    /// Costs O(leaves + grid cells x leaves in a column), where a column passes blocks of 8 cells a side cell
    /// by cell. [`OccupancyGrid::update`] brings the grid up to date for less.
    ///
    /// # Errors
    ///
    /// [`Error::Projection`] when `up` is zero or not finite, or `min_height < max_height` does not hold;
    /// [`Error::GridSize`].
    ///
    /// ```
    /// use dymlm_octree::{CellState, Octree, OctreeConfig};
    ///
    /// let mut map = Octree::new(OctreeConfig::default())?;
    /// map.insert_scan([0.0, 0.0, 1.01], &[[2.0, 0.01, 1.01]])?;
    /// let grid = map.project([0.0, 0.0, 1.0], 0.1, 1.8)?;
    /// assert_eq!((grid.width(), grid.height()), (41, 1));
    /// assert_eq!(grid.at(40, 0), CellState::Occupied);
    /// assert_eq!(grid.at(20, 0), CellState::Free);
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn project(&self, up: [f64; 3], min_height: f64, max_height: f64) -> Result<OccupancyGrid, Error> {
        let range = [min_height, max_height];
        let axes = checked_axes(up, range)?;
        let place = self.cells_between(axes, range);
        self.project_onto(axes, place, Heights::Same { range, grows: true })
    }

    /// [`Self::project`] for one region, given in the grid's axes: each cell is what the whole grid shows
    /// there, at a cost of O(cells of the region x leaves in a column). The grid has the cells that the
    /// region touches, whether anything was observed there or not.
    ///
    /// # Errors
    ///
    /// As [`Self::project`]; [`Error::GridRegion`] when the region ends before it begins or is not finite.
    ///
    /// ```
    /// use dymlm_octree::{CellState, GridRegion, Octree, OctreeConfig};
    ///
    /// let mut map = Octree::new(OctreeConfig::default())?;
    /// map.insert_scan([0.0, 0.0, 1.01], &[[2.0, 0.01, 1.01]])?;
    /// let around = GridRegion { min: [1.5, -0.5], max: [2.5, 0.5] };
    /// let grid = map.project_region([0.0, 0.0, 1.0], 0.1, 1.8, &around)?;
    /// assert_eq!((grid.width(), grid.height()), (20, 20));
    /// let [x, y] = grid.cell_of([2.01, 0.01]).ok_or("in the region")?;
    /// assert_eq!(grid.at(x, y), CellState::Occupied);
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn project_region(
        &self,
        up: [f64; 3],
        min_height: f64,
        max_height: f64,
        region: &GridRegion,
    ) -> Result<OccupancyGrid, Error> {
        let range = [min_height, max_height];
        let axes = checked_axes(up, range)?;
        region.check()?;
        let place = GridCells::of(region, self.resolution());
        self.project_onto(axes, place, Heights::Same { range, grows: false })
    }

    /// [`Self::project_region`] with heights for each cell: for a ramp, or for floors at several heights.
    /// `heights` is called with the centre of each cell, in the grid's axes; cells for which it gives no
    /// range, or one that ends before it begins, are unknown.
    ///
    /// # Errors
    ///
    /// [`Error::Projection`] when `up` is zero or not finite; [`Error::GridRegion`]; [`Error::GridSize`].
    ///
    /// ```
    /// use dymlm_octree::{CellState, GridRegion, Octree, OctreeConfig};
    ///
    /// // A ramp that rises by 0.25 m per metre.
    /// let mut map = Octree::new(OctreeConfig::default())?;
    /// let ramp: Vec<[f32; 3]> = (0..40).map(|i| 0.025 + 0.05 * i as f32).map(|x| [x, 0.025, 0.25 * x]).collect();
    /// map.insert_scan([1.0, 0.025, 1.5], &ramp)?;
    /// let region = GridRegion { min: [0.0, 0.0], max: [2.0, 0.05] };
    /// let level = map.project_region([0.0, 0.0, 1.0], 0.1, 1.0, &region)?;
    /// assert_eq!(level.at(30, 0), CellState::Occupied);
    /// let above = |[x, _]: [f64; 2]| Some([0.25 * x + 0.1, 0.25 * x + 1.0]);
    /// let grid = map.project_between([0.0, 0.0, 1.0], &region, above)?;
    /// assert_eq!(grid.at(30, 0), CellState::Free);
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn project_between(
        &self,
        up: [f64; 3],
        region: &GridRegion,
        heights: impl Fn([f64; 2]) -> Option<[f64; 2]>,
    ) -> Result<OccupancyGrid, Error> {
        let axes = checked_axes(up, [f64::NEG_INFINITY, f64::INFINITY])?;
        region.check()?;
        let place = GridCells::of(region, self.resolution());
        let frame = (axes, world_from_grid(axes)?);
        let mut grid = OccupancyGrid::over(place, self.resolution(), frame, Heights::by_cell(Vec::new()))?;
        let centers = (0..grid.cells.len()).map(|index| grid.center_of(index));
        let ranges = centers.map(|center| heights(center).unwrap_or(NO_HEIGHTS));
        grid.heights = Heights::by_cell(ranges.collect());
        grid.fill(&mut self.accessor());
        Ok(grid)
    }

    /// The region, in the axes of a grid, in which something was observed between two heights; `None` when
    /// nothing was. Only leaves that reach into one of the `boxes` by more than a quarter of a cell count, so
    /// none in a box thinner than half a cell. O(leaves in the boxes).
    ///
    /// # Errors
    ///
    /// [`Error::Projection`].
    pub fn region_between(
        &self,
        up: [f64; 3],
        min_height: f64,
        max_height: f64,
        boxes: &[Extent],
    ) -> Result<Option<GridRegion>, Error> {
        let range = [min_height, max_height];
        let axes = checked_axes(up, range)?;
        Ok(self.region_of(axes, range, boxes))
    }

    pub(super) fn region_of(
        &self,
        axes: [[f64; 3]; 3],
        range: HeightRange,
        boxes: &[Extent],
    ) -> Option<GridRegion> {
        // The boxes are shrunk by a quarter of a cell: leaves that only touch a box do not belong to it.
        let inset = 0.25 * self.resolution();
        let near = boxes.iter().filter(|own| Shadow::of_box(own, axes).is_between(range));
        let leaves =
            near.flat_map(|own| self.leaves_in_box(own.min.map(|c| c + inset), own.max.map(|c| c - inset)));
        region_of_leaves(leaves, axes, range)
    }

    /// The cells of a grid around the leaves that reach between the heights.
    fn cells_between(&self, axes: [[f64; 3]; 3], range: HeightRange) -> GridCells {
        let region = region_of_leaves(self.leaves(), axes, range);
        region.map_or_else(GridCells::default, |region| GridCells::of(&region, self.resolution()))
    }

    fn project_onto(
        &self,
        axes: [[f64; 3]; 3],
        place: GridCells,
        heights: Heights,
    ) -> Result<OccupancyGrid, Error> {
        let frame = (axes, world_from_grid(axes)?);
        let mut grid = OccupancyGrid::over(place, self.resolution(), frame, heights)?;
        grid.fill(&mut self.accessor());
        Ok(grid)
    }
}

fn region_of_leaves(
    leaves: impl Iterator<Item = Leaf>,
    axes: [[f64; 3]; 3],
    range: HeightRange,
) -> Option<GridRegion> {
    let shadows = leaves.map(|leaf| Shadow::of_leaf(&leaf, axes)).filter(|shadow| shadow.is_between(range));
    shadows.map(|shadow| shadow.region()).reduce(|one, other| one.united(&other))
}

/// The axes of a grid across `up`; an error when `up` has no direction, or the heights are no range.
fn checked_axes(up: [f64; 3], [min_height, max_height]: HeightRange) -> Result<[[f64; 3]; 3], Error> {
    let is_range = min_height.partial_cmp(&max_height) == Some(Ordering::Less);
    grid_axes(up).filter(|_| is_range).ok_or(Error::Projection { up, min_height, max_height })
}

impl OccupancyGrid {
    /// The pose in the world of the axes of grids across `up`, see [`Octree::project`].
    ///
    /// # Errors
    ///
    /// [`Error::Projection`] when `up` is zero or not finite.
    pub fn frame(up: [f64; 3]) -> Result<Pose, Error> {
        world_from_grid(checked_axes(up, [f64::NEG_INFINITY, f64::INFINITY])?)
    }

    /// Checks that a grid may have as many cells as a region needs.
    ///
    /// # Errors
    ///
    /// [`Error::GridRegion`]; [`Error::GridSize`].
    pub fn check_size(region: &GridRegion, resolution: f64) -> Result<(), Error> {
        region.check()?;
        cell_count(GridCells::of(region, resolution)).map(|_| ())
    }

    fn fill(&mut self, accessor: &mut Accessor<'_>) {
        for index in 0..self.cells.len() {
            self.cells[index] = self.projected(accessor, index);
        }
    }

    /// The state of a cell's column.
    pub(super) fn projected(&self, accessor: &mut Accessor<'_>, index: usize) -> CellState {
        let [x, y] = self.center_of(index);
        let foot = std::array::from_fn(|k| x * self.axes[0][k] + y * self.axes[1][k]);
        column_state(accessor, foot, self.axes[2], self.heights.of(index))
    }

    pub(super) fn center_of(&self, index: usize) -> [f64; 2] {
        self.center(index % self.width(), index / self.width())
    }
}
