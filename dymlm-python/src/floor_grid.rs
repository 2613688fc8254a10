//! The 2D grid of a floor.

use std::sync::{PoisonError, RwLock, RwLockReadGuard};

use dymlm::{FloorGrid, FloorGridConfig};
use numpy::PyArray1;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use toml::Table;

use crate::arrays::{Array1, rows};
use crate::config::table_of;
use crate::error::OrRaise;
use crate::map::PyMap;
use crate::occupancy_grid::{PyGridUpdate, PyOccupancyGrid, grid_region};

/// The 2D map of one floor for a robot that drives on it: the obstacles between two heights above the floor,
/// on ramps and landings too.
#[pyclass(frozen, name = "FloorGrid", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyFloorGrid(RwLock<FloorGrid>);

#[pymethods]
impl PyFloorGrid {
    /// A copy of the current grid, an OccupancyGrid.
    #[getter]
    fn grid(&self, py: Python<'_>) -> PyOccupancyGrid {
        PyOccupancyGrid::of(py.detach(|| self.floor().grid().clone()))
    }

    /// Ids of the planes that form the floor; the plane from which the search started comes first.
    #[getter]
    fn planes(&self, py: Python<'_>) -> Vec<u64> {
        py.detach(|| self.floor().planes().iter().map(|plane| plane.get()).collect())
    }

    /// Height of the floor at points (n, 2) in the grid's axes: (n,) float64, metres along up from the
    /// world's origin, NaN outside the grid.
    fn floor_heights<'py>(&self, py: Python<'py>, places: &Bound<'py, PyAny>) -> PyResult<Array1<'py, f64>> {
        let places = rows::<2>(places, "places")?;
        let heights = py.detach(|| {
            let floor = self.floor();
            places.into_iter().map(|place| floor.floor_height(place).unwrap_or(f64::NAN)).collect()
        });
        Ok(PyArray1::from_vec(py, heights))
    }

    /// Updates the grid in place from the maps that it was made of (`earlier`) to newer ones; every cell is
    /// as in a new grid over the same region. Returns a GridUpdate.
    fn update(
        &self,
        py: Python<'_>,
        earlier: &Bound<'_, PyMap>,
        map: &Bound<'_, PyMap>,
    ) -> PyResult<PyGridUpdate> {
        let (earlier, map) = (earlier.get().maps(), map.get().maps());
        let update =
            py.detach(|| self.0.write().unwrap_or_else(PoisonError::into_inner).update(&earlier, &map));
        update.or_raise().map(PyGridUpdate::of)
    }
}

impl PyFloorGrid {
    pub(crate) fn of(floor: FloorGrid) -> Self {
        Self(RwLock::new(floor))
    }

    fn floor(&self) -> RwLockReadGuard<'_, FloorGrid> {
        self.0.read().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The config from fields by name and a region.
pub(crate) fn floor_grid_config(
    region: Option<&Bound<'_, PyAny>>,
    fields: Option<&Bound<'_, PyDict>>,
) -> PyResult<FloorGridConfig> {
    let fields = fields.map_or_else(|| Ok(Table::new()), table_of)?;
    let mut config: FloorGridConfig = fields.try_into().or_raise()?;
    config.region = region.map(grid_region).transpose()?;
    Ok(config)
}
