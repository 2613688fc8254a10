//! Frames: images, detections and the camera's pose.

use dymlm::core::{ColorImage, DepthImage, Frame, Mask, PinholeCamera, PixelFormat, Pose};
use numpy::{PyArray3, PyArrayMethods, PyUntypedArrayMethods};
use pyo3::exceptions::PyTypeError;
use pyo3::prelude::*;

use crate::arrays::{Array2, array_of, described, image_to_array, rows_to_array, values};
use crate::camera::PyCamera;
use crate::detection::{DetectionsArgument, mask_to_array};
use crate::error::{OrRaise, refused};
use crate::pose::{PoseArgument, PyPose};

/// A frame with its detections and the camera's pose, which datasets and simulated sequences give and
/// MapBuilder.insert_frame takes. `depth`, `color`, `world_from_camera`, `detections` and `depth_scale` as in
/// MapBuilder.insert.
#[pyclass(frozen, name = "Frame", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyFrame {
    pub(crate) frame: Frame,
    pub(crate) found: DetectionsArgument,
    pub(crate) world_from_camera: Pose,
    pub(crate) truth: Option<FrameTruth>,
}

/// The truth about a frame, which only a simulation knows.
#[derive(Debug)]
pub(crate) struct FrameTruth {
    pub(crate) mover_mask: Mask,
    pub(crate) estimated_world_from_camera: Pose,
}

#[pymethods]
impl PyFrame {
    #[new]
    #[pyo3(signature = (camera, timestamp, depth, color = None, world_from_camera = None, detections = None, depth_scale = 1000.0))]
    fn new(
        camera: &Bound<'_, PyCamera>,
        timestamp: f64,
        depth: &Bound<'_, PyAny>,
        color: Option<&Bound<'_, PyAny>>,
        world_from_camera: Option<PoseArgument>,
        detections: Option<DetectionsArgument>,
        depth_scale: f64,
    ) -> PyResult<Self> {
        let images = GivenImages { depth, depth_scale, color };
        Ok(Self {
            frame: images.to_frame(timestamp, &camera.get().0, &mut ImageBuffers::default())?,
            found: detections.unwrap_or(DetectionsArgument::NotRun),
            world_from_camera: world_from_camera.map_or_else(Pose::identity, |pose| pose.0),
            truth: None,
        })
    }

    /// Time, seconds.
    #[getter]
    fn timestamp(&self) -> f64 {
        self.frame.timestamp()
    }

    /// The camera.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(*self.frame.camera())
    }

    /// Depth along the optical axis, (height, width) float32, metres; 0 where there is no reading. A copy.
    #[getter]
    fn depth<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py, f32>> {
        let depth = self.frame.depth();
        image_to_array(py, [depth.width(), depth.height()], depth.data().to_vec())
    }

    /// Colours, (height, width, 3) uint8: red, green, blue; None if the frame has none. A copy.
    #[getter]
    fn color<'py>(&self, py: Python<'py>) -> PyResult<Option<Bound<'py, PyArray3<u8>>>> {
        let Some(color) = self.frame.color() else { return Ok(None) };
        let pixels = rows_to_array(py, color.data().to_vec())?;
        pixels.reshape([color.height(), color.width(), 3]).map(Some)
    }

    /// The detections: a list of Detection, None when the detector did not run, "pending" while it still
    /// runs.
    #[getter]
    fn detections<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyAny>> {
        self.found.to_object(py)
    }

    /// The camera's pose; for a simulated frame, the exact one.
    #[getter]
    fn world_from_camera(&self) -> PyPose {
        PyPose(self.world_from_camera)
    }

    /// For a simulated frame, the pose as a SLAM would estimate it; else None.
    #[getter]
    fn estimated_world_from_camera(&self) -> Option<PyPose> {
        Some(PyPose(self.truth.as_ref()?.estimated_world_from_camera))
    }

    /// For a simulated frame, the exact mask of movers, (height, width) bool; else None.
    #[getter]
    fn mover_mask<'py>(&self, py: Python<'py>) -> PyResult<Option<Array2<'py, bool>>> {
        self.truth.as_ref().map(|truth| mask_to_array(py, &truth.mover_mask)).transpose()
    }

    /// For pickle and copy.
    fn __getnewargs__<'py>(&self, py: Python<'py>) -> PyResult<FrameParts<'py>> {
        if self.truth.is_some() {
            return Err(PyTypeError::new_err(
                "the truth about a simulated frame cannot be pickled: make a Frame of its images, or pass on \
                 the sequence's settings and the frame's index",
            ));
        }
        let (depth, color, found) = (self.depth(py)?, self.color(py)?, self.detections(py)?);
        Ok((self.camera(), self.timestamp(), depth, color, self.world_from_camera(), found))
    }

    fn __repr__(&self) -> String {
        let camera = self.frame.camera();
        format!(
            "<dymlm.Frame of {} s, {}x{} pixels>",
            self.frame.timestamp(),
            camera.width(),
            camera.height()
        )
    }
}

/// Camera, time, depth, colours, pose and detections.
type FrameParts<'py> =
    (PyCamera, f64, Array2<'py, f32>, Option<Bound<'py, PyArray3<u8>>>, PyPose, Bound<'py, PyAny>);

/// The images of a frame as the caller passes them.
#[derive(Clone, Copy)]
pub(crate) struct GivenImages<'a, 'py> {
    pub(crate) depth: &'a Bound<'py, PyAny>,
    pub(crate) depth_scale: f64,
    pub(crate) color: Option<&'a Bound<'py, PyAny>>,
}

/// Images that frames are read into, so that inserting a frame allocates no images.
#[derive(Debug, Default)]
pub(crate) struct ImageBuffers {
    depth: Option<DepthImage>,
    color: Option<ColorImage>,
}

impl ImageBuffers {
    /// Takes the images of a frame back.
    pub(crate) fn recycle(&mut self, frame: Frame) {
        let (depth, color) = frame.into_images();
        self.depth = Some(depth);
        self.color = color.or(self.color.take());
    }
}

impl GivenImages<'_, '_> {
    /// The frame of the images; each value is read once, directly from the caller's array.
    pub(crate) fn to_frame(
        self,
        timestamp: f64,
        camera: &PinholeCamera,
        buffers: &mut ImageBuffers,
    ) -> PyResult<Frame> {
        let depth = self.read_depth(camera, buffers.depth.take())?;
        let color = match self.color {
            Some(color) => Some(read_color(color, camera, buffers.color.take())?),
            None => None,
        };
        Frame::new(timestamp, *camera, depth, color).or_raise()
    }

    fn read_depth(self, camera: &PinholeCamera, buffer: Option<DepthImage>) -> PyResult<DepthImage> {
        let size = [camera.height(), camera.width()];
        let mut image = match buffer {
            Some(image) if [image.height(), image.width()] == size => image,
            _ => DepthImage::empty(camera.width(), camera.height()).or_raise()?,
        };
        if let Some(array) = array_of::<u16>(self.depth)? {
            check_shape("depth", array.shape(), &size)?;
            let mut kept = Vec::new();
            image.refill_from_u16(values(&array, &mut kept), camera.width(), self.depth_scale).or_raise()?;
        } else if let Some(array) = array_of::<f32>(self.depth)? {
            check_shape("depth", array.shape(), &size)?;
            let mut kept = Vec::new();
            image.refill_from_metres(values(&array, &mut kept), camera.width()).or_raise()?;
        } else {
            let given = described(self.depth);
            return Err(PyTypeError::new_err(format!(
                "depth that is {given}: an array of uint16 (with depth_scale) or float32 (metres) is needed"
            )));
        }
        Ok(image)
    }
}

fn read_color(
    given: &Bound<'_, PyAny>,
    camera: &PinholeCamera,
    buffer: Option<ColorImage>,
) -> PyResult<ColorImage> {
    let wrong =
        || PyTypeError::new_err(format!("colour that is {}: an array of uint8 is needed", described(given)));
    let array = array_of::<u8>(given)?.ok_or_else(wrong)?;
    let (width, height) = (camera.width(), camera.height());
    check_shape("colour", array.shape(), &[height, width, 3])?;
    let mut kept = Vec::new();
    let bytes = values(&array, &mut kept);
    match buffer {
        Some(mut image) if [image.width(), image.height()] == [width, height] => {
            image.refill_from_bytes(bytes, PixelFormat::Rgb8, 3 * width).or_raise()?;
            Ok(image)
        }
        _ => ColorImage::from_bytes(width, height, bytes, PixelFormat::Rgb8, 3 * width).or_raise(),
    }
}

fn check_shape(what: &str, actual: &[usize], needed: &[usize]) -> PyResult<()> {
    if actual == needed {
        return Ok(());
    }
    Err(refused(format!("{what} of shape {actual:?}: the camera needs {needed:?}")))
}
