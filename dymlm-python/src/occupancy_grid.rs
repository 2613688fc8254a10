//! The 2D grid.

use std::path::PathBuf;
use std::sync::{PoisonError, RwLock, RwLockReadGuard};

use dymlm::octree::{GridRegion, GridUpdate, OccupancyGrid};
use pyo3::prelude::*;

use crate::arrays::{Array1, Array2, image_to_array, to_vector, vector};
use crate::error::OrRaise;
use crate::octree::{PyOctree, code};
use crate::pose::PyPose;

/// A 2D map seen from above, in the plane of its own x and y axes; z is up.
#[pyclass(frozen, name = "OccupancyGrid", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyOccupancyGrid(RwLock<OccupancyGrid>);

#[pymethods]
impl PyOccupancyGrid {
    /// (height, width) int8: 1 occupied, 0 free, -1 unknown; row 0 has the lowest y. A copy.
    #[getter]
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py, i8>> {
        let (size, codes) = py.detach(|| {
            let grid = self.grid();
            ([grid.width(), grid.height()], grid.cells().iter().copied().map(code).collect())
        });
        image_to_array(py, size, codes)
    }

    /// Side of a cell, metres.
    #[getter]
    fn resolution(&self, py: Python<'_>) -> f64 {
        py.detach(|| self.grid().resolution())
    }

    /// The lower left corner of cell [0, 0] in the grid's axes (2,), metres.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> Array1<'py, f64> {
        let origin = py.detach(|| self.grid().origin());
        to_vector(py, origin)
    }

    /// Pose of the grid's axes in the world.
    #[getter]
    fn world_from_grid(&self, py: Python<'_>) -> PyPose {
        PyPose(py.detach(|| self.grid().world_from_grid()))
    }

    /// The same grid inflated: cells whose centre is within `radius` metres of an occupied cell's centre are
    /// occupied too.
    fn inflated(&self, py: Python<'_>, radius: f64) -> PyResult<Self> {
        py.detach(|| self.grid().inflated(radius)).or_raise().map(Self::of)
    }

    /// Updates the grid in place from the octree that it was made of (`earlier`) to a newer one. Every cell
    /// is as in a new projection, and the cost depends only on the changes. Returns a GridUpdate.
    fn update(
        &self,
        py: Python<'_>,
        earlier: &Bound<'_, PyOctree>,
        octree: &Bound<'_, PyOctree>,
    ) -> PyResult<PyGridUpdate> {
        let (earlier, octree) = (earlier.get(), octree.get());
        let update = py.detach(|| {
            let changes = octree.0.octree().changes_since(earlier.0.octree());
            self.0.write().unwrap_or_else(PoisonError::into_inner).update(octree.0.octree(), &changes)
        });
        update.or_raise().map(PyGridUpdate::of)
    }

    /// Writes `name.pgm` and `name.yaml` into a folder, as ROS' map_server reads them.
    fn save(&self, py: Python<'_>, folder: PathBuf, name: &str) -> PyResult<()> {
        py.detach(|| self.grid().save(folder, name)).or_raise()
    }
}

impl PyOccupancyGrid {
    pub(crate) fn of(grid: OccupancyGrid) -> Self {
        Self(RwLock::new(grid))
    }

    fn grid(&self) -> RwLockReadGuard<'_, OccupancyGrid> {
        self.0.read().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What updating a grid has changed.
#[pyclass(frozen, get_all, name = "GridUpdate", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyGridUpdate {
    /// Number of cells that were projected again.
    projected: usize,
    /// Number of cells that changed.
    changed: usize,
    /// First and last column, first and last row of a rectangle around the changed cells; None when there are
    /// none.
    bounds: Option<(usize, usize, usize, usize)>,
    /// Whether the grid has grown, so that the indices of its cells have changed.
    has_grown: bool,
}

impl PyGridUpdate {
    pub(crate) fn of(update: GridUpdate) -> Self {
        let bounds = update.bounds.map(|[[left, right], [low, high]]| (left, right, low, high));
        let GridUpdate { projected, changed, has_grown, .. } = update;
        Self { projected, changed, bounds, has_grown }
    }
}

/// x and y of the lower corner and of the upper one.
pub(crate) fn grid_region(given: &Bound<'_, PyAny>) -> PyResult<GridRegion> {
    let [x, y, max_x, max_y] = vector(given, "region")?;
    Ok(GridRegion { min: [x, y], max: [max_x, max_y] })
}
