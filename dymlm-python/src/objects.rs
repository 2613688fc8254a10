//! Objects.

use std::collections::BTreeMap;
use std::sync::Arc;

use dymlm::MultiLevelMap;
use dymlm::core::ObjectId;
use dymlm::objects::MapObject;
use pyo3::prelude::*;

use crate::arrays::{Array1, Array2, rows_to_array, to_vector};
use crate::error::refused;
use crate::pose::PyPose;

/// An object of a map: a box or an ellipsoid with a label. World frame, metres.
#[pyclass(frozen, name = "MapObject", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyMapObject {
    map: Arc<MultiLevelMap>,
    id: ObjectId,
}

#[pymethods]
impl PyMapObject {
    /// Its id, which never changes and is never used again.
    #[getter]
    fn id(&self) -> u64 {
        self.id.get()
    }

    /// The label with the most evidence.
    #[getter]
    fn label(&self) -> PyResult<&str> {
        Ok(self.object()?.label())
    }

    /// Share of the evidence that is for the label, 0 to 1.
    #[getter]
    fn score(&self) -> PyResult<f64> {
        Ok(self.object()?.score())
    }

    /// The evidence for each label: label to the sum of its detections' scores.
    #[getter]
    fn evidence(&self) -> PyResult<BTreeMap<&str, f64>> {
        Ok(self.object()?.evidence().iter().collect())
    }

    /// Centre of its box (3,).
    #[getter]
    fn center<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py, f64>> {
        Ok(to_vector(py, self.object()?.oriented_box().center()))
    }

    /// Full lengths of its box along its axes (3,).
    #[getter]
    fn size<'py>(&self, py: Python<'py>) -> PyResult<Array1<'py, f64>> {
        Ok(to_vector(py, self.object()?.oriented_box().lengths()))
    }

    /// The frame of its box: the origin is the centre, the axes are along the sides; the third axis is the
    /// normal of its support.
    #[getter]
    fn world_from_object(&self) -> PyResult<PyPose> {
        Ok(PyPose(self.object()?.oriented_box().world_from_box()))
    }

    /// Rotation matrix (3, 3): its columns are the box's axes.
    #[getter]
    fn rotation<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py, f64>> {
        rows_to_array(py, self.object()?.oriented_box().world_from_box().rotation_matrix().to_vec())
    }

    /// The corners of its box (8, 3); corner k is on the positive side of axis i if bit i of k is set.
    #[getter]
    fn corners<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py, f64>> {
        rows_to_array(py, self.object()?.oriented_box().corners().to_vec())
    }

    /// Its shape: "cuboid", or "ellipsoid" inscribed in the box.
    #[getter]
    fn shape(&self) -> PyResult<&'static str> {
        Ok(self.object()?.shape().kind().name())
    }

    /// Number of its detections.
    #[getter]
    fn observations(&self) -> PyResult<u32> {
        Ok(self.object()?.observations())
    }

    /// Time of the first observation, seconds.
    #[getter]
    fn first_seen(&self) -> PyResult<f64> {
        Ok(self.object()?.first_seen())
    }

    /// Time of the last observation, seconds.
    #[getter]
    fn last_seen(&self) -> PyResult<f64> {
        Ok(self.object()?.last_seen())
    }

    /// Id of the plane that it stands on; None when its support is not a plane of the map, or unknown.
    #[getter]
    fn support(&self) -> PyResult<Option<u64>> {
        Ok(self.object()?.support().and_then(|support| support.id).map(dymlm::core::PlaneId::get))
    }

    /// Its surface points (n, 3) float64, one per voxel.
    #[getter]
    fn points<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py, f64>> {
        rows_to_array(py, self.object()?.points().collect())
    }

    fn __repr__(&self) -> PyResult<String> {
        let object = self.object()?;
        let (center, size) = (object.oriented_box().center(), object.oriented_box().lengths());
        Ok(format!("<dymlm.MapObject {}: {:?} at {center:.2?}, size {size:.2?}>", self.id, object.label()))
    }
}

impl PyMapObject {
    pub(crate) fn of(map: &Arc<MultiLevelMap>, id: ObjectId) -> Self {
        Self { map: Arc::clone(map), id }
    }

    /// The object in its map, which does not change.
    pub(crate) fn object(&self) -> PyResult<&MapObject> {
        self.map.objects().object(self.id).ok_or_else(|| refused(format!("no object {} in the map", self.id)))
    }
}
