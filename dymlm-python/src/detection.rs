//! The output of a 2D detector for a frame.

use dymlm::Detections;
use dymlm::core::{BoundingBox, Detection, Mask};
use numpy::{PyArrayDyn, PyUntypedArrayMethods};
use pyo3::Borrowed;
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::arrays::{Array2, array_of, described, image_to_array, values, vector};
use crate::error::{OrRaise, refused};

/// A detection of a 2D detector: a label (COCO's names, such as "person"), a box `x_min, y_min, x_max, y_max`
/// in pixels, a score, 0 to 1, and, if the detector gives one, an instance mask (height, width) of bools,
/// `True` on the thing.
#[pyclass(frozen, eq, name = "Detection", module = "dymlm")]
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct PyDetection(pub(crate) Detection);

#[pymethods]
impl PyDetection {
    #[new]
    #[pyo3(signature = (label, r#box, score, mask = None))]
    fn new(
        label: String,
        r#box: &Bound<'_, PyAny>,
        score: f32,
        mask: Option<&Bound<'_, PyAny>>,
    ) -> PyResult<Self> {
        let [x_min, y_min, x_max, y_max] = vector(r#box, "box")?.map(|side: f64| side as f32);
        let bounding_box = BoundingBox::new(x_min, y_min, x_max, y_max).or_raise()?;
        let detection = Detection::new(label, score, bounding_box).or_raise()?;
        Ok(Self(match mask {
            Some(mask) => detection.with_mask(mask_of(mask)?),
            None => detection,
        }))
    }

    /// The detected class.
    #[getter]
    fn label(&self) -> &str {
        self.0.label()
    }

    /// Its box: x_min, y_min, x_max, y_max, pixels.
    #[getter]
    fn r#box(&self) -> [f32; 4] {
        self.0.bounding_box().into()
    }

    /// The detector's confidence, 0 to 1.
    #[getter]
    fn score(&self) -> f32 {
        self.0.score()
    }

    /// The instance mask, (height, width) bool, True on the thing; None if the detector gave none.
    #[getter]
    fn mask<'py>(&self, py: Python<'py>) -> PyResult<Option<Array2<'py, bool>>> {
        self.0.mask().map(|mask| mask_to_array(py, mask)).transpose()
    }

    /// For pickle and copy.
    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<DetectionParts<'py>> {
        Ok((self.label().to_owned(), self.r#box(), self.score(), self.mask(py)?))
    }

    fn __repr__(&self) -> String {
        format!("Detection({:?}, box={:?}, score={})", self.label(), self.r#box(), self.score())
    }
}

/// Label, box, score and mask.
type DetectionParts<'py> = (String, [f32; 4], f32, Option<Array2<'py, bool>>);

/// Converts an array (height, width) of bools to a mask.
pub(crate) fn mask_of(given: &Bound<'_, PyAny>) -> PyResult<Mask> {
    if given.cast::<PyArrayDyn<bool>>().is_err() {
        return Err(PyTypeError::new_err(format!("a mask that is {}: bool is needed", described(given))));
    }
    // numpy's bools may be any bytes, where Rust's are 0 or 1: 255 after `view(bool)`, for one.
    let bytes = given.call_method1("view", ("uint8",))?;
    let array = array_of::<u8>(&bytes)?.ok_or_else(|| refused("a mask whose bytes cannot be read"))?;
    let &[height, width] = array.shape() else {
        return Err(refused(format!("a mask of shape {:?}: (height, width) is needed", array.shape())));
    };
    let pixels = values(&array, &mut Vec::new()).iter().map(|&byte| byte != 0).collect();
    Mask::new(width, height, pixels).or_raise()
}

/// Converts a mask to an array (height, width) of bools.
pub(crate) fn mask_to_array<'py>(py: Python<'py>, mask: &Mask) -> PyResult<Array2<'py, bool>> {
    image_to_array(py, [mask.width(), mask.height()], mask.pixels().collect())
}

/// The argument `detections`: a list, None when the detector did not run, "pending" while it still runs.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum DetectionsArgument {
    Found(Vec<Detection>),
    NotRun,
    Pending,
}

impl DetectionsArgument {
    pub(crate) fn detections(&self) -> Detections<'_> {
        match self {
            Self::Found(found) => Detections::Found(found),
            Self::NotRun => Detections::NotRun,
            Self::Pending => Detections::Pending,
        }
    }

    /// Converts it back to the argument.
    pub(crate) fn to_object<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        Ok(match self {
            Self::Found(found) => {
                let found: Vec<PyDetection> = found.iter().cloned().map(PyDetection).collect();
                found.into_pyobject(py)?.into_any()
            }
            Self::NotRun => py.None().into_bound(py),
            Self::Pending => "pending".into_pyobject(py)?.into_any(),
        })
    }
}

impl<'py> FromPyObject<'_, 'py> for DetectionsArgument {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if given.is_none() {
            return Ok(Self::NotRun);
        }
        if let Ok(word) = given.extract::<String>() {
            return match word.as_str() {
                "pending" => Ok(Self::Pending),
                _ => Err(refused(format!("detections {word:?}: a list, None or \"pending\" is needed"))),
            };
        }
        detections_of(&given).map(Self::Found)
    }
}

/// The detections of a Python sequence.
pub(crate) fn detections_of(given: &Bound<'_, PyAny>) -> PyResult<Vec<Detection>> {
    let detection = |one: PyResult<Bound<'_, PyAny>>| Ok(one?.cast::<PyDetection>()?.get().0.clone());
    given.try_iter()?.map(detection).collect()
}
