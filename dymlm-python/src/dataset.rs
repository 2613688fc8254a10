//! Recorded datasets.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

use dymlm_io::{FrameBuffers, TumOptions, TumRecording};
use numpy::PyArray1;
use pyo3::exceptions::{PyIndexError, PyUserWarning};
use pyo3::ffi::c_str;
use pyo3::prelude::*;

use crate::arrays::Array1;

use crate::camera::PyCamera;
use crate::detection::DetectionsArgument;
use crate::error::OrRaise;
use crate::frame::PyFrame;

/// A TUM RGB-D folder: images, `camera.json`, poses (`groundtruth.txt`, or the file `trajectory`) and
/// detections (`detections.jsonl`, or the file or YOLO folder `detections`). `every`: only every n-th frame.
/// `dataset[i]` loads a Frame; a loop over the dataset loads all frames, and skips with a warning those that
/// cannot be loaded.
#[pyclass(frozen, name = "Dataset", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyDataset {
    folder: PathBuf,
    recording: TumRecording,
}

#[pymethods]
impl PyDataset {
    #[new]
    #[pyo3(signature = (folder, *, trajectory = None, detections = None, every = 1))]
    fn new(
        py: Python<'_>,
        folder: PathBuf,
        trajectory: Option<PathBuf>,
        detections: Option<PathBuf>,
        every: usize,
    ) -> PyResult<Self> {
        let mut options = TumOptions::default();
        (options.trajectory, options.every) = (trajectory, every);
        let open = || TumRecording::open(&folder, detections.as_deref().map(Path::new), &options);
        let recording = py.detach(open).or_raise()?;
        Ok(Self { folder, recording })
    }

    /// The camera of the frames.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(*self.recording.dataset().camera())
    }

    /// Times of the frames (n,) float64, seconds.
    #[getter]
    fn timestamps<'py>(&self, py: Python<'py>) -> Array1<'py, f64> {
        let frames = self.recording.dataset().frames().iter();
        PyArray1::from_vec(py, frames.map(|frame| frame.timestamp).collect())
    }

    /// Problems with its lists and detections, a list of texts.
    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.recording.warnings()
    }

    fn __len__(&self) -> usize {
        self.recording.dataset().frames().len()
    }

    fn __getitem__(&self, py: Python<'_>, index: isize) -> PyResult<PyFrame> {
        self.load(py, frame_index(index, self.__len__())?)
    }

    fn __iter__(slf: Bound<'_, Self>) -> PyDatasetFrames {
        PyDatasetFrames { dataset: slf.unbind(), next: AtomicUsize::new(0) }
    }

    fn __repr__(&self) -> String {
        format!("<dymlm.Dataset {}: {} frames>", self.folder.display(), self.__len__())
    }
}

impl PyDataset {
    fn load(&self, py: Python<'_>, index: usize) -> PyResult<PyFrame> {
        // Python keeps the frame and its images, so buffers are not reused.
        let loaded = py.detach(|| self.recording.load(index, &mut FrameBuffers::default())).or_raise()?;
        Ok(PyFrame {
            frame: loaded.frame,
            found: loaded.detections.map_or(DetectionsArgument::NotRun, DetectionsArgument::Found),
            world_from_camera: loaded.world_from_camera,
            truth: None,
        })
    }
}

/// The frames of a dataset, one after the other; threads that share it get different ones.
#[pyclass(frozen, name = "DatasetFrames", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyDatasetFrames {
    dataset: Py<PyDataset>,
    next: AtomicUsize,
}

#[pymethods]
impl PyDatasetFrames {
    fn __iter__(slf: Bound<'_, Self>) -> Bound<'_, Self> {
        slf
    }

    fn __next__(&self, py: Python<'_>) -> PyResult<Option<PyFrame>> {
        let dataset = self.dataset.get();
        while let Some(index) = next_below(&self.next, dataset.__len__()) {
            match dataset.load(py, index) {
                Ok(frame) => return Ok(Some(frame)),
                Err(error) => {
                    let words = std::ffi::CString::new(format!("frame {index} skipped: {}", error.value(py)));
                    let words = words.unwrap_or_else(|_| c_str!("a frame was skipped").to_owned());
                    PyErr::warn(py, &py.get_type::<PyUserWarning>(), &words, 1)?;
                }
            }
        }
        Ok(None)
    }
}

/// The next of some frames, for one thread alone; `None` after the last.
pub(crate) fn next_below(next: &AtomicUsize, count: usize) -> Option<usize> {
    next.fetch_update(Relaxed, Relaxed, |next| (next < count).then_some(next + 1)).ok()
}

/// The index of a frame; negative indices count from the end.
pub(crate) fn frame_index(index: isize, count: usize) -> PyResult<usize> {
    let place = if index < 0 { count.checked_add_signed(index) } else { usize::try_from(index).ok() };
    let wrong = || PyIndexError::new_err(format!("frame {index} of {count}"));
    place.filter(|&place| place < count).ok_or_else(wrong)
}
