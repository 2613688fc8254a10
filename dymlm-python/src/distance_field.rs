//! Distances to obstacles.

use dymlm::octree::DistanceField;
use numpy::PyArray1;
use pyo3::prelude::*;

use crate::arrays::{Array1, Array2, rows, rows_to_array};

/// Distances to the nearest obstacle in a box of the world, with their gradients.
#[pyclass(frozen, name = "DistanceField", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyDistanceField(pub(crate) DistanceField);

#[pymethods]
impl PyDistanceField {
    /// At points (n, 3): distances (n,) float64, metres, at most `max_distance`, and their derivatives (n, 3)
    /// along x, y and z, away from the obstacle; NaN outside the box.
    fn at<'py>(
        &self,
        py: Python<'py>,
        points: &Bound<'py, PyAny>,
    ) -> PyResult<(Array1<'py, f64>, Array2<'py, f64>)> {
        let points = rows::<3>(points, "points")?;
        let (distances, gradients): (Vec<f64>, Vec<[f64; 3]>) = py.detach(|| {
            let at = |point| match self.0.at(point) {
                Some(clearance) => (clearance.distance, clearance.gradient),
                None => (f64::NAN, [f64::NAN; 3]),
            };
            points.into_iter().map(at).unzip()
        });
        Ok((PyArray1::from_vec(py, distances), rows_to_array(py, gradients)?))
    }

    /// The greatest distance that is reported, metres.
    #[getter]
    fn max_distance(&self) -> f64 {
        self.0.max_distance()
    }
}
