//! Finite planes.

use std::sync::Arc;

use dymlm::MultiLevelMap;
use dymlm::core::PlaneId;
use dymlm::planes::{BoundaryPolygon, MapPlane};
use numpy::PyArray2;
use pyo3::prelude::*;

use crate::arrays::{Array1, Array2, rows_to_array, to_vector};
use crate::error::refused;

/// A finite plane of a map. World frame, metres: normal . x + offset = 0, and the normal points towards the
/// cameras that saw it.
#[pyclass(frozen, name = "Plane", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyPlane {
    map: Arc<MultiLevelMap>,
    id: PlaneId,
}

#[pymethods]
impl PyPlane {
    /// Its id, which never changes and is never used again.
    #[getter]
    fn id(&self) -> u64 {
        self.id.get()
    }

    /// Unit normal (3,).
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py, f64>> {
        Ok(to_vector(py, self.plane()?.plane().normal()))
    }

    /// Offset, metres.
    #[getter]
    fn offset(&self) -> PyResult<f64> {
        Ok(self.plane()?.plane().d())
    }

    /// Weighted mean of its inliers (3,), metres.
    #[getter]
    fn centroid<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py, f64>> {
        Ok(to_vector(py, self.plane()?.centroid()))
    }

    /// Area that was seen, square metres.
    #[getter]
    fn area(&self) -> PyResult<f64> {
        Ok(self.plane()?.area())
    }

    /// Mean squared distance of its inliers, square metres.
    #[getter]
    fn mse(&self) -> PyResult<f64> {
        Ok(self.plane()?.mse())
    }

    /// Number of key frames that saw it.
    #[getter]
    fn observations(&self) -> PyResult<u32> {
        Ok(self.plane()?.observations())
    }

    /// Time of the first key frame that saw it, seconds.
    #[getter]
    fn first_seen(&self) -> PyResult<f64> {
        Ok(self.plane()?.first_seen())
    }

    /// Time of the last key frame that saw it, seconds.
    #[getter]
    fn last_seen(&self) -> PyResult<f64> {
        Ok(self.plane()?.last_seen())
    }

    /// Its outlines with their holes, a list of Boundary, the largest first.
    #[getter]
    fn boundary(&self, py: Python<'_>) -> PyResult<Vec<PyBoundary>> {
        self.plane()?.boundary().into_iter().map(|polygon| PyBoundary::of(py, polygon)).collect()
    }

    /// Its inliers (n, 3) float32, one per voxel, metres.
    #[getter]
    fn inliers<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py, f32>> {
        rows_to_array(py, self.plane()?.inlier_points().collect())
    }

    fn __repr__(&self) -> PyResult<String> {
        let plane = self.plane()?;
        let (normal, offset) = (plane.plane().normal(), plane.plane().d());
        Ok(format!(
            "<dymlm.Plane {}: normal {normal:.3?}, offset {offset:.3}, {:.2} m2>",
            self.id,
            plane.area()
        ))
    }
}

impl PyPlane {
    pub(crate) fn of(map: &Arc<MultiLevelMap>, id: PlaneId) -> Self {
        Self { map: Arc::clone(map), id }
    }

    /// The plane in its map, which does not change.
    pub(crate) fn plane(&self) -> PyResult<&MapPlane> {
        self.map.planes().plane(self.id).ok_or_else(|| refused(format!("no plane {} in the map", self.id)))
    }
}

/// A connected piece of a plane. World frame, metres; rings are closed without repeating their first corner.
/// Seen against the normal, outlines run counterclockwise and holes clockwise.
#[pyclass(frozen, get_all, name = "Boundary", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyBoundary {
    /// The outer ring (k, 3) float64.
    outline: Py<PyArray2<f64>>,
    /// The rings of the holes, a list of (k, 3) float64.
    holes: Vec<Py<PyArray2<f64>>>,
    /// Area of the outline minus its holes, square metres.
    area: f64,
}

impl PyBoundary {
    fn of(py: Python<'_>, polygon: BoundaryPolygon) -> PyResult<Self> {
        let area = polygon.area();
        let ring = |ring| Ok::<_, PyErr>(rows_to_array(py, ring)?.unbind());
        let holes: PyResult<_> = polygon.holes.into_iter().map(ring).collect();
        Ok(Self { outline: ring(polygon.outline)?, holes: holes?, area })
    }
}
