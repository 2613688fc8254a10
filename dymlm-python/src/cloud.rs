//! The dense cloud as arrays.

use dymlm::core::PointCloud;
use numpy::PyArray2;
use pyo3::prelude::*;

use crate::arrays::rows_to_array;

/// Points with colours, in a fixed order. Each call of `Map.cloud` makes new arrays.
#[pyclass(frozen, get_all, name = "Cloud", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyCloud {
    /// (n, 3) float32, metres, world.
    positions: Py<PyArray2<f32>>,
    /// (n, 3) uint8: red, green, blue; None when no frame had colours.
    colors: Option<Py<PyArray2<u8>>>,
}

#[pymethods]
impl PyCloud {
    fn __len__(&self, py: Python<'_>) -> PyResult<usize> {
        self.positions.bind(py).len()
    }

    fn __repr__(&self, py: Python<'_>) -> PyResult<String> {
        Ok(format!("<dymlm.Cloud of {} points>", self.__len__(py)?))
    }
}

impl PyCloud {
    pub(crate) fn of(py: Python<'_>, cloud: PointCloud) -> PyResult<Self> {
        let (points, colors) = cloud.into_parts();
        let colors = colors.map(|colors| Ok::<_, PyErr>(rows_to_array(py, colors)?.unbind()));
        Ok(Self { positions: rows_to_array(py, points)?.unbind(), colors: colors.transpose()? })
    }
}
