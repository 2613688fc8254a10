//! Simulated sequences.

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;

use dymlm_sim::{
    CarriedKind, CarriedMotion, CarriedObject, Sequence, SequenceConfig, SequenceType, SimulatedFrame, Truth,
    TruthConfig,
};
use pyo3::prelude::*;

use crate::camera::PyCamera;
use crate::dataset::{frame_index, next_below};
use crate::detection::DetectionsArgument;
use crate::error::{OrRaise, refused};
use crate::frame::{FrameTruth, PyFrame};
use crate::pose::PyPose;
use crate::truth::PySequenceTruth;

/// A rendered sequence with exact truth. `sequence[i]` renders a Frame, the same one each time.
#[pyclass(frozen, name = "Sequence", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PySequence(Arc<Sequence>);

/// The built-in sequence: people walk through an office, seen by a Kinect-like camera. name: "walking_xyz",
/// "walking_static", "walking_halfsphere", "walking_rpy", or the same with "sitting"; None: the sequence of
/// the program build_map. `frames`: number at 10 a second, by default 150; `every`: only every n-th of these,
/// with noise and detections of their own; `people`: 0 to 2; `camera`: another camera; `carried`: "book",
/// "keyboard", "bottle", "cup" or "box": such a thing stands on the table, and a hand moves it between seconds
/// 1 and 7.
#[pyfunction]
#[pyo3(signature = (name = None, *, frames = None, every = 1, people = None, seed = None, camera = None, carried = None))]
#[expect(clippy::too_many_arguments, reason = "named in Python")]
pub(crate) fn builtin_sequence(
    py: Python<'_>,
    name: Option<&str>,
    frames: Option<usize>,
    every: usize,
    people: Option<usize>,
    seed: Option<u64>,
    camera: Option<&Bound<'_, PyCamera>>,
    carried: Option<&str>,
) -> PyResult<PySequence> {
    let mut config = match name {
        None => SequenceConfig::default(),
        Some(name) => {
            let unknown = || {
                let names: Vec<_> = SequenceType::ALL.iter().map(|kind| kind.name()).collect();
                refused(format!("no sequence {name:?}; there are: {}", names.join(", ")))
            };
            SequenceType::ALL.iter().find(|kind| kind.name() == name).ok_or_else(unknown)?.config()
        }
    };
    config.frames = frames.unwrap_or(config.frames).div_ceil(every.max(1));
    config.frame_rate /= every.max(1) as f64;
    config.people = people.unwrap_or(config.people);
    config.seed = seed.unwrap_or(config.seed);
    config.camera = camera.map(|camera| camera.get().0).or(config.camera);
    config.carried = carried.map(carried_object).transpose()?;
    Ok(PySequence(Arc::new(py.detach(|| Sequence::new(&config)).or_raise()?)))
}

fn carried_object(name: &str) -> PyResult<CarriedObject> {
    let kind = match name {
        "book" => CarriedKind::Book,
        "keyboard" => CarriedKind::Keyboard,
        "bottle" => CarriedKind::Bottle,
        "cup" => CarriedKind::Cup,
        "box" => CarriedKind::Box,
        other => {
            return Err(refused(format!("carried {other:?}: book, keyboard, bottle, cup or box is needed")));
        }
    };
    Ok(CarriedObject::new(kind, CarriedMotion::Translation))
}

#[pymethods]
impl PySequence {
    /// The camera.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(*self.0.camera())
    }

    /// The exact poses of all frames, a list of Pose.
    #[getter]
    fn poses(&self) -> Vec<PyPose> {
        (0..self.0.len()).map(|index| PyPose(self.0.world_from_camera(index))).collect()
    }

    /// The truth about the world: static surfaces, movers, faces and objects, and which of them these frames
    /// have seen. Renders all frames.
    fn truth(&self, py: Python<'_>) -> PyResult<PySequenceTruth> {
        py.detach(|| Truth::of(&self.0, &TruthConfig::default())).or_raise().map(PySequenceTruth)
    }

    fn __len__(&self) -> usize {
        self.0.len()
    }

    fn __getitem__(&self, py: Python<'_>, index: isize) -> PyResult<PyFrame> {
        self.render(py, frame_index(index, self.0.len())?)
    }

    fn __iter__(slf: Bound<'_, Self>) -> PySequenceFrames {
        PySequenceFrames { sequence: slf.unbind(), next: AtomicUsize::new(0) }
    }

    fn __repr__(&self) -> String {
        format!("<dymlm.Sequence of {} frames>", self.0.len())
    }
}

impl PySequence {
    fn render(&self, py: Python<'_>, place: usize) -> PyResult<PyFrame> {
        let frame = py.detach(|| self.0.frame(place)).ok_or_else(|| refused(format!("no frame {place}")))?;
        let SimulatedFrame { frame, detections, world_from_camera, mover_mask, .. } = frame;
        let estimated_world_from_camera = self.0.estimated_pose(place);
        Ok(PyFrame {
            frame,
            found: DetectionsArgument::Found(detections),
            world_from_camera,
            truth: Some(FrameTruth { mover_mask, estimated_world_from_camera }),
        })
    }
}

/// The frames of a sequence, one after the other; threads that share it get different ones.
#[pyclass(frozen, name = "SequenceFrames", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PySequenceFrames {
    sequence: Py<PySequence>,
    next: AtomicUsize,
}

#[pymethods]
impl PySequenceFrames {
    fn __iter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<PyFrame>> {
        let sequence = self.sequence.get();
        next_below(&self.next, sequence.0.len()).map(|place| sequence.render(py, place)).transpose()
    }
}
