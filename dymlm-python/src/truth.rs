//! The truth that maps are scored against.

use dymlm::core::Plane;
use dymlm::geometry::OrientedBox;
use dymlm_metrics::{PointTruth, SpaceTruth, TrueFace, TrueObject};
use dymlm_sim::Truth;
use pyo3::prelude::*;

use crate::arrays::{Array1, points, rows, to_vector, vector};
use crate::error::{OrRaise, refused};
use crate::pose::{PoseArgument, PyPose};

/// The exact truth about a simulated sequence.
#[pyclass(frozen, name = "SequenceTruth", module = "dymlm.metrics")]
#[derive(Debug)]
pub(crate) struct PySequenceTruth(pub(crate) Truth);

#[pymethods]
impl PySequenceTruth {
    /// All flat faces of the static scene, a list of TrueFace.
    #[getter]
    fn faces(&self) -> Vec<PyTrueFace> {
        self.0.faces().into_iter().map(PyTrueFace).collect()
    }

    /// All labelled static things, a list of TrueObject.
    #[getter]
    fn objects(&self) -> Vec<PyTrueObject> {
        self.0.objects().into_iter().map(PyTrueObject).collect()
    }
}

/// Truth from measured points: a scan of the static world (n, 3) whose neighbours are at most 2 cm apart, and
/// readings of movers (m, 3): points within `margin` metres of these count as swept by movers.
#[pyclass(frozen, name = "PointTruth", module = "dymlm.metrics")]
#[derive(Debug)]
pub(crate) struct PyPointTruth(PointTruth);

#[pymethods]
impl PyPointTruth {
    #[new]
    #[pyo3(signature = (surface, movers = None, margin = 0.1))]
    fn new(
        py: Python<'_>,
        surface: &Bound<'_, PyAny>,
        movers: Option<&Bound<'_, PyAny>>,
        margin: f64,
    ) -> PyResult<Self> {
        let surface = points(surface, "surface")?;
        let movers = movers.map(|movers| points(movers, "movers")).transpose()?.unwrap_or_default();
        Ok(Self(py.detach(|| PointTruth::new(surface, &movers, margin)).or_raise()?))
    }
}

/// Either kind of truth, as an argument.
#[derive(Debug, FromPyObject)]
pub(crate) enum TruthArgument<'py> {
    Sequence(Bound<'py, PySequenceTruth>),
    Points(Bound<'py, PyPointTruth>),
}

impl TruthArgument<'_> {
    pub(crate) fn truth(&self) -> &(dyn SpaceTruth + Sync) {
        match self {
            Self::Sequence(truth) => &truth.get().0,
            Self::Points(truth) => &truth.get().0,
        }
    }
}

/// A flat face of the true world that was seen as a whole: the plane normal . x + offset = 0, whose normal
/// points to the side from which it can be seen, and an outline (k, 3) on it, rasterized in cells of `cell`
/// metres.
#[pyclass(frozen, name = "TrueFace", module = "dymlm.metrics")]
#[derive(Debug, Clone)]
pub(crate) struct PyTrueFace(pub(crate) TrueFace);

#[pymethods]
impl PyTrueFace {
    #[new]
    #[pyo3(signature = (id, normal, offset, outline, cell = 0.02))]
    fn new(
        id: usize,
        normal: &Bound<'_, PyAny>,
        offset: f64,
        outline: &Bound<'_, PyAny>,
        cell: f64,
    ) -> PyResult<Self> {
        let plane = Plane::new(vector(normal, "normal")?, offset).or_raise()?;
        let outline = rows::<3>(outline, "outline")?;
        let face = TrueFace::new(id, plane, vec![outline], cell);
        face.map(Self).ok_or_else(|| refused("an outline that encloses no cell"))
    }

    /// Identifies the face.
    #[getter]
    fn id(&self) -> usize {
        self.0.id
    }

    /// Unit normal (3,).
    #[getter]
    fn normal<'py>(&self, py: Python<'py>) -> Array1<'py, f64> {
        to_vector(py, self.0.plane.normal())
    }

    /// Offset, metres.
    #[getter]
    fn offset(&self) -> f64 {
        self.0.plane.d()
    }

    /// Area, square metres.
    #[getter]
    fn area(&self) -> f64 {
        self.0.area
    }

    /// Area that was seen, square metres.
    #[getter]
    fn visible_area(&self) -> f64 {
        self.0.visible_area
    }
}

/// A labelled thing of the true world that was seen in `frames_visible` frames. The third axis of its box is
/// the vertical; size: full lengths along the axes (3,), metres.
#[pyclass(frozen, name = "TrueObject", module = "dymlm.metrics")]
#[derive(Debug, Clone)]
pub(crate) struct PyTrueObject(pub(crate) TrueObject);

#[pymethods]
impl PyTrueObject {
    #[new]
    #[pyo3(signature = (id, label, world_from_object, size, frames_visible = 8))]
    fn new(
        id: usize,
        label: &str,
        world_from_object: PoseArgument,
        size: &Bound<'_, PyAny>,
        frames_visible: u32,
    ) -> PyResult<Self> {
        let oriented_box = OrientedBox::new(world_from_object.0, vector(size, "size")?).or_raise()?;
        Ok(Self(TrueObject::new(id, label, oriented_box, frames_visible)))
    }

    /// Identifies the thing.
    #[getter]
    fn id(&self) -> usize {
        self.0.id
    }

    /// COCO label.
    #[getter]
    fn label(&self) -> &str {
        &self.0.label
    }

    /// The frame of its box.
    #[getter]
    fn world_from_object(&self) -> PyPose {
        PyPose(self.0.oriented_box.world_from_box())
    }

    /// Full lengths along its axes (3,), metres.
    #[getter]
    fn size<'py>(&self, py: Python<'py>) -> Array1<'py, f64> {
        to_vector(py, self.0.oriented_box.lengths())
    }

    /// Number of frames that saw it.
    #[getter]
    fn frames_visible(&self) -> u32 {
        self.0.frames_visible
    }
}
