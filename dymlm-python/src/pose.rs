//! Rigid motions.

use dymlm::core::Pose;
use pyo3::prelude::*;
use pyo3::{Borrowed, intern};

use crate::arrays::{Array1, Array2, matrix, rows_to_array, to_vector, vector};
use crate::error::{OrRaise, refused};

/// A rigid motion, such as `world_from_camera`, which takes camera coordinates to the world.
///
/// Made of a translation (3,) in metres and a quaternion (4,) `x, y, z, w`, or of one argument that every
/// `world_from_camera` accepts too: a 4x4 matrix, or seven numbers `tx ty tz qx qy qz qw`.
/// `numpy.asarray(pose)` is the 4x4 matrix. Camera coordinates: x to the right, y down, z forward.
#[pyclass(frozen, eq, name = "Pose", module = "dymlm")]
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct PyPose(pub(crate) Pose);

#[pymethods]
impl PyPose {
    #[new]
    #[pyo3(signature = (translation, quaternion = None))]
    fn new(translation: &Bound<'_, PyAny>, quaternion: Option<&Bound<'_, PyAny>>) -> PyResult<Self> {
        let Some(quaternion) = quaternion else { return Ok(Self(pose_of(translation)?)) };
        let translation = vector(translation, "translation")?;
        Ok(Self(Pose::new(translation, vector(quaternion, "quaternion")?).or_raise()?))
    }

    /// The identity.
    #[staticmethod]
    fn identity() -> Self {
        Self(Pose::identity())
    }

    /// Translation (3,), metres.
    #[getter]
    fn translation<'py>(&self, py: Python<'py>) -> Array1<'py, f64> {
        to_vector(py, self.0.translation())
    }

    /// Unit quaternion (4,): x, y, z, w.
    #[getter]
    fn quaternion<'py>(&self, py: Python<'py>) -> Array1<'py, f64> {
        to_vector(py, self.0.quaternion())
    }

    /// The 4x4 matrix, float64.
    #[getter]
    fn matrix<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py, f64>> {
        let ([a, b, c], [x, y, z]) = (self.0.rotation_matrix(), self.0.translation());
        let rows =
            vec![[a[0], a[1], a[2], x], [b[0], b[1], b[2], y], [c[0], c[1], c[2], z], [0.0, 0.0, 0.0, 1.0]];
        rows_to_array(py, rows)
    }

    /// The inverse motion.
    fn inverse(&self) -> Self {
        Self(self.0.inverse())
    }

    /// The motion that applies first the other, then this one.
    fn __matmul__(&self, other: PoseArgument) -> Self {
        Self(self.0 * other.0)
    }

    #[pyo3(signature = (dtype = None, copy = None))]
    fn __array__<'py>(
        &self,
        py: Python<'py>,
        dtype: Option<&Bound<'py, PyAny>>,
        copy: Option<bool>,
    ) -> PyResult<Bound<'py, PyAny>> {
        // The matrix is new at each call, so `copy` has no effect.
        let _ = copy;
        let matrix = self.matrix(py)?.into_any();
        match dtype {
            Some(dtype) => matrix.call_method1(intern!(py, "astype"), (dtype,)),
            None => Ok(matrix),
        }
    }

    /// For pickle and copy.
    fn __getnewargs__(&self) -> ([f64; 3], [f64; 4]) {
        (self.0.translation(), self.0.quaternion())
    }

    fn __repr__(&self) -> String {
        format!("Pose(translation={:?}, quaternion={:?})", self.0.translation(), self.0.quaternion())
    }
}

/// A pose argument: a [`PyPose`], a 4x4 matrix, or seven numbers.
#[derive(Debug, Clone, Copy)]
pub(crate) struct PoseArgument(pub(crate) Pose);

impl<'py> FromPyObject<'_, 'py> for PoseArgument {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        pose_of(&given).map(Self)
    }
}

fn pose_of(given: &Bound<'_, PyAny>) -> PyResult<Pose> {
    if let Ok(pose) = given.cast::<PyPose>() {
        return Ok(pose.get().0);
    }
    let Some([a, b, c, last]) = matrix::<4, 4>(given, "a pose")? else {
        let [x, y, z, qx, qy, qz, qw] = vector(given, "a pose, neither (4, 4) nor seven numbers,")?;
        return Pose::new([x, y, z], [qx, qy, qz, qw]).or_raise();
    };
    if last != [0.0, 0.0, 0.0, 1.0] {
        return Err(refused(format!("a pose whose last row is {last:?}: [0, 0, 0, 1] is needed")));
    }
    let rotation = [a, b, c].map(|[x, y, z, _]| [x, y, z]);
    Pose::from_rotation_matrix(rotation, [a[3], b[3], c[3]]).or_raise()
}
