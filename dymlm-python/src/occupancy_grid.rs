//! The 2D grid.

use std::path::PathBuf;

use dymlm::octree::OccupancyGrid;
use pyo3::prelude::*;

use crate::arrays::{Array1, Array2, image_to_array, to_vector};
use crate::error::OrRaise;
use crate::octree::code;
use crate::pose::PyPose;

/// A 2D map seen from above, in the plane of its own x and y axes; z is up.
#[pyclass(frozen, name = "OccupancyGrid", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyOccupancyGrid(pub(crate) OccupancyGrid);

#[pymethods]
impl PyOccupancyGrid {
    /// (height, width) int8: 1 occupied, 0 free, -1 unknown; row 0 has the lowest y.
    #[getter]
    fn cells<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py, i8>> {
        let codes = self.0.cells().iter().copied().map(code).collect();
        image_to_array(py, [self.0.width(), self.0.height()], codes)
    }

    /// Side of a cell, metres.
    #[getter]
    fn resolution(&self) -> f64 {
        self.0.resolution()
    }

    /// The lower left corner of cell [0, 0] in the grid's axes (2,), metres.
    #[getter]
    fn origin<'py>(&self, py: Python<'py>) -> Array1<'py, f64> {
        to_vector(py, self.0.origin())
    }

    /// Where the grid's axes are in the world.
    #[getter]
    fn world_from_grid(&self) -> PyPose {
        PyPose(self.0.world_from_grid())
    }

    /// Writes `name.pgm` and `name.yaml` into a folder, as ROS' map_server reads them.
    fn save(&self, folder: PathBuf, name: &str) -> PyResult<()> {
        self.0.save(folder, name).or_raise()
    }
}
