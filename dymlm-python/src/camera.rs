//! The camera.

use dymlm::core::PinholeCamera;
use pyo3::prelude::*;

use crate::error::OrRaise;

/// A pinhole camera: size in pixels, focal lengths and principal point in pixels. Depth and colour have the
/// same size and are registered to each other. Images of lenses with distortion must be rectified first.
#[pyclass(frozen, eq, name = "Camera", module = "dymlm")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PyCamera(pub(crate) PinholeCamera);

#[pymethods]
impl PyCamera {
    #[new]
    fn new(width: usize, height: usize, fx: f64, fy: f64, cx: f64, cy: f64) -> PyResult<Self> {
        Ok(Self(PinholeCamera::new(width, height, fx, fy, cx, cy).or_raise()?))
    }

    /// Width, pixels.
    #[getter]
    fn width(&self) -> usize {
        self.0.width()
    }

    /// Height, pixels.
    #[getter]
    fn height(&self) -> usize {
        self.0.height()
    }

    /// Focal length along x, pixels.
    #[getter]
    fn fx(&self) -> f64 {
        self.0.fx()
    }

    /// Focal length along y, pixels.
    #[getter]
    fn fy(&self) -> f64 {
        self.0.fy()
    }

    /// Principal point, column, pixels.
    #[getter]
    fn cx(&self) -> f64 {
        self.0.cx()
    }

    /// Principal point, row, pixels.
    #[getter]
    fn cy(&self) -> f64 {
        self.0.cy()
    }

    /// For pickle and copy.
    fn __getnewargs__(&self) -> (usize, usize, f64, f64, f64, f64) {
        let Self(camera) = self;
        (camera.width(), camera.height(), camera.fx(), camera.fy(), camera.cx(), camera.cy())
    }

    fn __repr__(&self) -> String {
        let Self(camera) = self;
        format!(
            "Camera(width={}, height={}, fx={}, fy={}, cx={}, cy={})",
            camera.width(),
            camera.height(),
            camera.fx(),
            camera.fy(),
            camera.cx(),
            camera.cy()
        )
    }
}
