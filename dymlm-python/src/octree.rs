//! The occupancy octree as arrays.

use std::sync::Arc;

use dymlm::MultiLevelMap;
use dymlm::octree::{CellState, Extent, Leaf, RayEnd, UnknownCells};
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::arrays::{Array1, Array2, rows, rows_to_array, to_vector, vector};
use crate::distance_field::PyDistanceField;
use crate::error::{OrRaise, refused};
use crate::occupancy_grid::{PyOccupancyGrid, grid_region};
use crate::static_points::rays;

/// The occupancy octree, with OctoMap's model. States in arrays of int8: 1 occupied, 0 free, -1 unknown
/// (never observed). Lengths in metres, world.
#[pyclass(frozen, name = "Octree", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyOctree(pub(crate) Arc<MultiLevelMap>);

#[pymethods]
impl PyOctree {
    /// Side of the smallest cell, metres.
    #[getter]
    fn resolution(&self) -> f64 {
        self.0.octree().resolution()
    }

    /// Lower and upper corner (3,) of the box around all leaves; None for an empty map.
    #[getter]
    fn extent<'py>(&self, py: Python<'py>) -> Option<(Array1<'py, f64>, Array1<'py, f64>)> {
        let extent = py.detach(|| self.0.octree().extent())?;
        Some((to_vector(py, extent.min), to_vector(py, extent.max)))
    }

    /// States of the cells at points (n, 3): (n,) int8.
    fn states<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Array1<'py, i8>> {
        let points = rows::<3>(points, "points")?;
        let states: Vec<i8> = py.detach(|| {
            let mut accessor = self.0.octree().accessor();
            points.into_iter().map(|point| code(accessor.state(point))).collect()
        });
        Ok(PyArray1::from_vec(py, states))
    }

    /// Log-odds of occupancy of the cells at points (n, 3): (n,) float32, NaN for unknown cells.
    fn log_odds<'py>(&self, py: Python<'py>, points: &Bound<'py, PyAny>) -> PyResult<Array1<'py, f32>> {
        let points = rows::<3>(points, "points")?;
        let log_odds: Vec<f32> = py.detach(|| {
            let mut accessor = self.0.octree().accessor();
            points.into_iter().map(|point| accessor.log_odds(point).unwrap_or(f32::NAN)).collect()
        });
        Ok(PyArray1::from_vec(py, log_odds))
    }

    /// The occupied leaves, all or those that overlap a box: (n, 4) float64, centre x, y, z and side.
    #[pyo3(signature = (low = None, high = None))]
    fn occupied<'py>(
        &self,
        py: Python<'py>,
        low: Option<&Bound<'py, PyAny>>,
        high: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<Array2<'py, f64>> {
        let region = region(low, high)?;
        let is_occupied = |leaf: &Leaf| leaf.state == CellState::Occupied;
        rows_to_array(py, py.detach(|| self.leaves_in(region).filter(is_occupied).map(place).collect()))
    }

    /// All leaves, or those that overlap a box, in OctoMap's order: cubes (n, 4) float64, centre and side;
    /// log-odds (n,) float32; states (n,) int8.
    #[pyo3(signature = (low = None, high = None))]
    #[expect(clippy::type_complexity, reason = "three results")]
    fn leaves<'py>(
        &self,
        py: Python<'py>,
        low: Option<&Bound<'py, PyAny>>,
        high: Option<&Bound<'py, PyAny>>,
    ) -> PyResult<(Array2<'py, f64>, Array1<'py, f32>, Array1<'py, i8>)> {
        let region = region(low, high)?;
        let (places, (log_odds, states)): (Vec<[f64; 4]>, (Vec<f32>, Vec<i8>)) = py.detach(|| {
            self.leaves_in(region).map(|leaf| (place(leaf), (leaf.log_odds, code(leaf.state)))).unzip()
        });
        let (log_odds, states) = (PyArray1::from_vec(py, log_odds), PyArray1::from_vec(py, states));
        Ok((rows_to_array(py, places)?, log_odds, states))
    }

    /// Follows rays through free cells to the first occupied one. origins (n, 3) or (3,) for all, directions
    /// (n, 3) of any length; unknown: "stop" (a ray ends at a cell never observed) or "pass". Returns the
    /// distances (n,) float64 from the origin to where the ray enters the cell in which it ends, the centres
    /// of these cells (n, 3) float64, and the reasons why rays ended, a list of "occupied", "unknown",
    /// "max_range" or "border"; NaN and None for an origin outside the map.
    #[pyo3(signature = (origins, directions, max_range = f64::INFINITY, unknown = "stop"))]
    #[expect(clippy::type_complexity, reason = "three results")]
    fn cast_rays<'py>(
        &self,
        py: Python<'py>,
        origins: &Bound<'py, PyAny>,
        directions: &Bound<'py, PyAny>,
        max_range: f64,
        unknown: &str,
    ) -> PyResult<(Array1<'py, f64>, Array2<'py, f64>, Vec<Option<&'static str>>)> {
        let (rays, unknown) = (rays(origins, directions)?, unknown_cells(unknown)?);
        let (distances, (centers, ends)): (Vec<f64>, (Vec<[f64; 3]>, Vec<_>)) = py.detach(|| {
            let mut accessor = self.0.octree().accessor();
            let cast = |[origin, direction]: [[f64; 3]; 2]| match accessor
                .cast_ray(origin, direction, max_range, unknown)
            {
                Some(hit) => (hit.distance, (hit.center, Some(name(hit.end)))),
                None => (f64::NAN, ([f64::NAN; 3], None)),
            };
            rays.into_iter().map(cast).unzip()
        });
        Ok((PyArray1::from_vec(py, distances), rows_to_array(py, centers)?, ends))
    }

    /// The occupied leaf nearest to each of the points (n, 3), within `max_distance`: distances (n,) float64
    /// to its surface and cubes (n, 4), centre and side; inf and NaN where there is none.
    #[pyo3(signature = (points, max_distance = f64::INFINITY))]
    fn nearest_obstacles<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
        max_distance: f64,
    ) -> PyResult<(Array1<'py, f64>, Array2<'py, f64>)> {
        let points = rows::<3>(points, "points")?;
        let (distances, places): (Vec<f64>, Vec<[f64; 4]>) = py.detach(|| {
            let nearest = |point| match self.0.octree().nearest_obstacle(point, max_distance) {
                Some(found) => {
                    let [x, y, z] = found.center;
                    (found.distance, [x, y, z, found.size])
                }
                None => (f64::INFINITY, [f64::NAN; 4]),
            };
            points.into_iter().map(nearest).unzip()
        });
        Ok((PyArray1::from_vec(py, distances), rows_to_array(py, places)?))
    }

    /// A 2D grid seen from above: the cells between two heights along `up` (3,) from the world's origin.
    /// region: x and y of the lower and of the upper corner (4,) of the grid, in its own axes; None:
    /// everything observed.
    #[pyo3(signature = (up, min_height, max_height, region = None))]
    fn project(
        &self,
        py: Python<'_>,
        up: &Bound<'_, PyAny>,
        min_height: f64,
        max_height: f64,
        region: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<PyOccupancyGrid> {
        let (up, region, octree) = (vector(up, "up")?, region.map(grid_region).transpose()?, self.0.octree());
        let grid = py.detach(|| match region {
            Some(region) => octree.project_region(up, min_height, max_height, &region),
            None => octree.project(up, min_height, max_height),
        });
        grid.or_raise().map(PyOccupancyGrid::of)
    }

    /// Distances to the nearest obstacle, up to `max_distance`, and their gradients everywhere in a box;
    /// unknown: "pass" (unknown cells are free) or "stop" (they are obstacles).
    #[pyo3(signature = (low, high, max_distance, unknown = "pass"))]
    fn distance_field(
        &self,
        py: Python<'_>,
        low: &Bound<'_, PyAny>,
        high: &Bound<'_, PyAny>,
        max_distance: f64,
        unknown: &str,
    ) -> PyResult<PyDistanceField> {
        let region = Extent { min: vector(low, "low")?, max: vector(high, "high")? };
        let unknown = unknown_cells(unknown)?;
        let field = py.detach(|| self.0.octree().distance_field(region, max_distance, unknown));
        field.or_raise().map(PyDistanceField)
    }
}

impl PyOctree {
    fn leaves_in(&self, region: Option<[[f64; 3]; 2]>) -> impl Iterator<Item = Leaf> {
        match region {
            Some([low, high]) => self.0.octree().leaves_in_box(low, high),
            None => self.0.octree().leaves(),
        }
    }
}

/// The code of a state in arrays.
pub(crate) fn code(state: CellState) -> i8 {
    match state {
        CellState::Occupied => 1,
        CellState::Free => 0,
        CellState::Unknown => -1,
    }
}

fn name(end: RayEnd) -> &'static str {
    match end {
        RayEnd::Occupied => "occupied",
        RayEnd::Unknown => "unknown",
        RayEnd::MaxRange => "max_range",
        RayEnd::Border => "border",
    }
}

fn place(leaf: Leaf) -> [f64; 4] {
    let [x, y, z] = leaf.center;
    [x, y, z, leaf.size]
}

fn region(
    low: Option<&Bound<'_, PyAny>>,
    high: Option<&Bound<'_, PyAny>>,
) -> PyResult<Option<[[f64; 3]; 2]>> {
    match (low, high) {
        (None, None) => Ok(None),
        (Some(low), Some(high)) => Ok(Some([vector(low, "low")?, vector(high, "high")?])),
        _ => Err(refused("a box has two corners: low and high")),
    }
}

fn unknown_cells(word: &str) -> PyResult<UnknownCells> {
    match word {
        "stop" => Ok(UnknownCells::Stop),
        "pass" => Ok(UnknownCells::Pass),
        other => Err(refused(format!("unknown {other:?}: \"stop\" or \"pass\" is needed"))),
    }
}
