//! Builds the maps.

use std::collections::BTreeMap;
use std::sync::{Mutex, PoisonError};
use std::time::{Duration, Instant};

use dymlm::core::{FrameId, ObjectId, PinholeCamera, Pose};
use dymlm::tracking::ObjectTrackerConfig;
use dymlm::{FrameInput, HistoryConfig, MapBuilder, MapConfig, RefineConfig};
use pyo3::Borrowed;
use pyo3::prelude::*;
use pyo3::types::{PyDict, PyInt, PyMapping};
use toml::Table;

use crate::arrays::{Array2, points, vector};
use crate::camera::PyCamera;
use crate::config::{PyConfig, table_of};
use crate::correction::{PyCorrectionReport, PyLoopClosure, PyRefineReport};
use crate::detection::{DetectionsArgument, detections_of, mask_to_array};
use crate::error::{OrRaise, refused, stopped, unknown_frame};
use crate::exclusive::Exclusive;
use crate::frame::{GivenImages, ImageBuffers, PyFrame};
use crate::map::{PyMap, memory_of};
use crate::object_tracker::{PyObjectMove, PyObjectTracker};
use crate::pose::{PoseArgument, PyPose};
use crate::reader::PyMapReader;
use crate::report::PyFrameReport;

/// Least time between two looks for an interrupt during a correction.
const BETWEEN_LOOKS: Duration = Duration::from_millis(20);

/// Builds four maps of the static world (cloud, octree, planes, objects) from frames, 2D detections and
/// poses, while people walk through it. Frames come in the order of their time.
///
/// While a call runs, other threads of Python run. Threads may share a builder: their calls run one after the
/// other. A refused call raises an exception and changes nothing.
#[pyclass(frozen, name = "MapBuilder", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyMapBuilder {
    camera: PinholeCamera,
    /// None once the builder is finished.
    builder: Exclusive<Option<MapBuilder>>,
    buffers: Mutex<ImageBuffers>,
}

#[pymethods]
impl PyMapBuilder {
    #[new]
    #[pyo3(signature = (camera, config = None))]
    fn new(camera: &Bound<'_, PyCamera>, config: Option<&Bound<'_, PyConfig>>) -> PyResult<Self> {
        let config = config.map_or_else(MapConfig::default, |config| config.get().0.clone());
        Ok(Self::of(camera, MapBuilder::new(config).or_raise()?))
    }

    /// Continues a map of an earlier session: its ids and its clock go on. Poses are in its world.
    #[staticmethod]
    fn resume(py: Python<'_>, map: &Bound<'_, PyMap>, camera: &Bound<'_, PyCamera>) -> PyResult<Self> {
        let maps = map.get().maps();
        let builder = py.detach(|| MapBuilder::resume((*maps).clone())).or_raise()?;
        Ok(Self::of(camera, builder))
    }

    /// Takes in one frame.
    ///
    /// timestamp: seconds. depth: (height, width), uint16 with `depth_scale` units a metre (1000:
    /// millimetres, 5000: TUM), or float32 metres; 0 and NaN are no readings. color: (height, width, 3)
    /// uint8, red, green, blue, registered to the depth image. world_from_camera: a Pose, a 4x4 matrix, or
    /// `tx ty tz qx qy qz qw`. detections: a list of Detection, empty when the detector found nothing; None
    /// when it did not run; "pending" while it still runs, then pass them to `detections_for` later.
    ///
    /// Arrays may be views with any strides. Each value is read once, into images that the builder reuses.
    #[pyo3(signature = (timestamp, depth, color = None, *, world_from_camera, detections = None, depth_scale = 1000.0))]
    #[expect(clippy::too_many_arguments, reason = "named in Python")]
    fn insert(
        &self,
        py: Python<'_>,
        timestamp: f64,
        depth: &Bound<'_, PyAny>,
        color: Option<&Bound<'_, PyAny>>,
        world_from_camera: PoseArgument,
        detections: Option<DetectionsArgument>,
        depth_scale: f64,
    ) -> PyResult<PyFrameReport> {
        let mut buffers = self.take_buffers();
        let images = GivenImages { depth, depth_scale, color };
        let frame = images.to_frame(timestamp, &self.camera, &mut buffers)?;
        let found = detections.unwrap_or(DetectionsArgument::NotRun);
        let input = FrameInput::new(&frame, found.detections(), &world_from_camera.0);
        let report = self.with(py, |builder| builder.insert_frame(&input).or_raise());
        buffers.recycle(frame);
        *self.buffers.lock().unwrap_or_else(PoisonError::into_inner) = buffers;
        PyFrameReport::of(py, report?)
    }

    /// Takes in a Frame of a dataset or a simulation, with its own pose and detections.
    fn insert_frame(&self, py: Python<'_>, frame: &Bound<'_, PyFrame>) -> PyResult<PyFrameReport> {
        let frame = frame.get();
        let input = FrameInput::new(&frame.frame, frame.found.detections(), &frame.world_from_camera);
        let report = self.with(py, |builder| builder.insert_frame(&input).or_raise())?;
        PyFrameReport::of(py, report)
    }

    /// Takes in a scan of a lidar: points (n, 3) in the sensor's frame, metres. It goes into cloud and
    /// octree.
    fn insert_scan(
        &self,
        py: Python<'_>,
        timestamp: f64,
        points: &Bound<'_, PyAny>,
        world_from_sensor: PoseArgument,
    ) -> PyResult<PyFrameReport> {
        let points = self::points(points, "points")?;
        let insert = |builder: &mut MapBuilder| builder.insert_scan(timestamp, &points, &world_from_sensor.0);
        let report = self.with(py, |builder| insert(builder).or_raise())?;
        PyFrameReport::of(py, report)
    }

    /// Passes on the detections of a frame that was inserted with "pending". With a history, also the
    /// detections of a key frame that was mapped without any.
    fn detections_for(
        &self,
        py: Python<'_>,
        frame: u64,
        detections: &Bound<'_, PyAny>,
    ) -> PyResult<PyFrameReport> {
        let found = detections_of(detections)?;
        let report =
            self.with(py, |builder| builder.detections_for(FrameId::new(frame), &found).or_raise())?;
        PyFrameReport::of(py, report)
    }

    /// Processes all waiting frames; those still without detections count as frames on which the detector did
    /// not run.
    fn process_waiting(&self, py: Python<'_>) -> PyResult<Vec<Py<PyFrameReport>>> {
        let reports = self.with(py, |builder| builder.process_waiting().or_raise())?;
        PyFrameReport::of_all(py, reports)
    }

    /// Removes at once from octree, planes and objects what the newest frames have found not to belong to the
    /// static world; otherwise this happens once a second.
    fn settle(&self, py: Python<'_>) -> PyResult<()> {
        self.with(py, |builder| {
            builder.settle();
            Ok(())
        })
    }

    /// Chooses an object of the map to be followed while somebody carries it. In the given Frame, the object
    /// must still stand where the map has it. Returns an ObjectTracker.
    fn track_object(
        &self,
        py: Python<'_>,
        object: u64,
        frame: &Bound<'_, PyFrame>,
    ) -> PyResult<PyObjectTracker> {
        let (object, frame) = (ObjectId::new(object), frame.get());
        let config = ObjectTrackerConfig::default();
        let tracker = self.with(py, |builder| {
            builder.track_object(object, &frame.frame, &frame.world_from_camera, &config).or_raise()
        })?;
        Ok(PyObjectTracker::of(object, tracker))
    }

    /// Tells the maps what a tracker has found in its last frame; call this before that frame is inserted.
    /// While the object moves, its pixels are kept out of the maps. Once it has come to rest, all maps have
    /// it at its new place, its old place is empty, and an ObjectMove is returned; else None.
    fn follow_object(
        &self,
        py: Python<'_>,
        tracker: &Bound<'_, PyObjectTracker>,
    ) -> PyResult<Option<PyObjectMove>> {
        let tracker = tracker.get();
        let (own, update) = tracker.last_found(py)?;
        let follow =
            |builder: &mut MapBuilder| builder.follow_object(tracker.object, &own, &update).or_raise();
        let moved = self.with(py, follow)?;
        Ok(moved.as_ref().map(PyObjectMove::of))
    }

    /// Ends the carrying of an object that is not followed any more, as where its carrier has left with it:
    /// the map has it where it stood, and removes it where frames look through that place.
    fn release_object(&self, py: Python<'_>, object: u64) -> PyResult<()> {
        self.with(py, |builder| builder.release_object(ObjectId::new(object)).or_raise())
    }

    /// The maps in their current state: a Map that does not change while the builder goes on. It shares
    /// unchanged memory with the builder.
    fn map(&self, py: Python<'_>) -> PyResult<PyMap> {
        self.with(py, |builder| Ok(PyMap::of(builder.map().clone())))
    }

    /// A reader of the maps for other threads, which never waits for the builder.
    fn reader(&self, py: Python<'_>) -> PyResult<PyMapReader> {
        self.with(py, |builder| Ok(PyMapReader(builder.reader())))
    }

    /// Processes the waiting frames, settles, and returns the maps; the builder then accepts no more frames.
    fn finish(&self, py: Python<'_>) -> PyResult<PyMap> {
        let finish = |builder: &mut Option<MapBuilder>| {
            builder.as_mut().ok_or_else(finished)?.process_waiting().or_raise()?;
            let builder = builder.take().ok_or_else(finished)?;
            Ok(PyMap::of(builder.into_map()))
        };
        self.builder.with(py, finish)?
    }

    /// Gives frames new poses, as after a loop closure, and all four maps follow: they are, to the bit, the
    /// maps that the same observations at the new poses would have made. Needs a history. poses: new poses by
    /// frame id (int) or by timestamp (float, as inserted), not both in one call; other frames move with
    /// their neighbours. Ctrl-C cancels the call, and nothing has changed.
    fn correct_poses(&self, py: Python<'_>, poses: &Bound<'_, PyMapping>) -> PyResult<PyCorrectionReport> {
        let pair = |item: Bound<'_, PyAny>| {
            let (frame, pose): (Bound<'_, PyAny>, Bound<'_, PyAny>) = item.extract()?;
            Ok((frame.extract()?, pose.extract::<PoseArgument>()?.0))
        };
        let poses: PyResult<Vec<(FrameKey, Pose)>> = poses.items()?.iter().map(pair).collect();
        let poses = poses?;
        check_one_kind(&poses)?;
        let report = self.with(py, |builder| {
            let by_time = FramesByTime::of(builder, &poses);
            let poses: PyResult<Vec<_>> =
                poses.iter().map(|(key, pose)| Ok((by_time.frame(*key)?, *pose))).collect();
            let (mut interruption, mut last_look) = (None, Instant::now());
            let mut watch = |_| {
                // To look takes the interpreter's lock, for which another thread may let this one wait longer
                // than a scan takes to be mapped.
                if last_look.elapsed() < BETWEEN_LOOKS {
                    return true;
                }
                last_look = Instant::now();
                #[expect(clippy::redundant_closure_for_method_calls, reason = "the path is of one lifetime")]
                let signal = Python::attach(|py| py.check_signals());
                interruption = signal.err();
                interruption.is_none()
            };
            let report = builder.correct_poses_watched(&poses?, &mut watch);
            interruption.map_or_else(|| report.or_raise(), Err)
        })?;
        Ok(PyCorrectionReport::of(&report))
    }

    /// Removes a frame or a scan from all maps, as if it had never been inserted. Needs a history. frame: its
    /// id, or its timestamp.
    fn remove(&self, py: Python<'_>, frame: FrameKey) -> PyResult<PyCorrectionReport> {
        let report = self.with(py, |builder| {
            let id = FramesByTime::of(builder, &[(frame, Pose::identity())]).frame(frame)?;
            builder.remove(id).or_raise()
        })?;
        Ok(PyCorrectionReport::of(&report))
    }

    /// Moves the whole world: each frame's new pose is `new_from_old` times its old one. Needs a history.
    fn transform(&self, py: Python<'_>, new_from_old: PoseArgument) -> PyResult<PyCorrectionReport> {
        let report = self.with(py, |builder| builder.transform(&new_from_old.0).or_raise())?;
        Ok(PyCorrectionReport::of(&report))
    }

    /// Refines the poses by the planes and objects that the key frames have seen, and all maps follow. Needs
    /// a history. closures: a list of LoopClosure; the report names those that were rejected. Further
    /// keywords are the fields of Rust's `RefineConfig`, such as `rounds=3` or `translation_per_second=0.05`.
    #[pyo3(signature = (closures = None, **fields))]
    fn refine_poses(
        &self,
        py: Python<'_>,
        closures: Option<Vec<Bound<'_, PyLoopClosure>>>,
        fields: Option<&Bound<'_, PyDict>>,
    ) -> PyResult<PyRefineReport> {
        let fields = fields.map_or_else(|| Ok(Table::new()), table_of)?;
        let config: RefineConfig = fields.try_into().or_raise()?;
        let closures: Vec<_> = closures.unwrap_or_default().iter().map(|closure| closure.get().0).collect();
        let refined = self.with(py, |builder| Ok(builder.refine_poses_with(&config, &closures)))?;
        refined.map(PyRefineReport::of).map_err(|error| stopped(py, error))
    }

    /// The frames that were inserted: a list of (id, timestamp, Pose), with the poses at which they are
    /// mapped now. Empty without a history.
    fn trajectory(&self, py: Python<'_>) -> PyResult<Vec<(u64, f64, PyPose)>> {
        self.with(py, |builder| {
            let frames = builder.trajectory();
            Ok(frames.map(|(id, timestamp, pose)| (id.get(), timestamp, PyPose(pose))).collect())
        })
    }

    /// Begins another session in the same world: its clock may restart, and movers are tracked anew.
    fn begin_session(&self, py: Python<'_>) -> PyResult<Vec<Py<PyFrameReport>>> {
        let reports = self.with(py, |builder| builder.begin_session().or_raise())?;
        PyFrameReport::of_all(py, reports)
    }

    /// Removes from all maps everything farther than `radius` metres from a point (3,) in the world.
    fn forget_outside(&self, py: Python<'_>, center: &Bound<'_, PyAny>, radius: f64) -> PyResult<()> {
        let center = vector(center, "center")?;
        self.with(py, |builder| {
            builder.forget_outside(center, radius);
            Ok(())
        })
    }

    /// Memory in bytes of each map, of the stored key frames ("history"), of earlier states ("snapshots") and
    /// of the maps that readers see ("published"). "unfiled_history" is the part of "history" that the file
    /// has refused, on a full disk.
    fn memory(&self, py: Python<'_>) -> PyResult<BTreeMap<&'static str, usize>> {
        self.with(py, |builder| Ok(memory_of(builder.memory())))
    }

    /// The static pixels of the last frame, (height, width) bool, for every `sensor.stride`-th pixel of every
    /// `sensor.stride`-th row.
    fn static_mask<'py>(&self, py: Python<'py>) -> PyResult<Array2<'py, bool>> {
        let mask = self.with(py, |builder| Ok(builder.preprocessor().static_mask().clone()))?;
        mask_to_array(py, &mask)
    }

    /// The settings.
    #[getter]
    fn config(&self, py: Python<'_>) -> PyResult<PyConfig> {
        self.with(py, |builder| Ok(PyConfig(builder.config().clone())))
    }

    /// The camera of `insert`.
    #[getter]
    fn camera(&self) -> PyCamera {
        PyCamera(self.camera)
    }
}

impl PyMapBuilder {
    fn of(camera: &Bound<'_, PyCamera>, builder: MapBuilder) -> Self {
        let builder = Exclusive::new(Some(builder));
        Self { camera: camera.get().0, builder, buffers: Mutex::default() }
    }

    /// Runs `work` on the builder, without the GIL.
    fn with<R: Send>(
        &self,
        py: Python<'_>,
        work: impl FnOnce(&mut MapBuilder) -> PyResult<R> + Send,
    ) -> PyResult<R> {
        self.builder.with(py, |builder| work(builder.as_mut().ok_or_else(finished)?))?
    }

    /// The images that the next frame is read into; another thread that inserts at the same time allocates
    /// its own.
    fn take_buffers(&self) -> ImageBuffers {
        std::mem::take(&mut *self.buffers.lock().unwrap_or_else(PoisonError::into_inner))
    }
}

fn finished() -> PyErr {
    refused("the builder is finished: continue with MapBuilder.resume")
}

/// A frame named by id or by time.
#[derive(Debug, Clone, Copy)]
enum FrameKey {
    Id(u64),
    Time(f64),
}

impl<'py> FromPyObject<'_, 'py> for FrameKey {
    type Error = PyErr;

    fn extract(given: Borrowed<'_, 'py, PyAny>) -> PyResult<Self> {
        if let Ok(id) = given.extract() {
            return Ok(Self::Id(id));
        }
        if given.is_instance_of::<PyInt>() {
            return Err(unknown_frame(format!("no frame was inserted with the id {}", &*given)));
        }
        given.extract().map(Self::Time)
    }
}

/// To Python, 2 and 2.0 are the same key: a dictionary that names frames in both ways may have lost one
/// already.
fn check_one_kind<T>(poses: &[(FrameKey, T)]) -> PyResult<()> {
    let times = poses.iter().filter(|(key, _)| matches!(key, FrameKey::Time(_))).count();
    if times == 0 || times == poses.len() {
        return Ok(());
    }
    Err(refused("frames named by id and by timestamp in one call: 2 and 2.0 are one key of a dictionary"))
}

/// Looks up frames by the time at which they were inserted.
struct FramesByTime {
    /// The frames asked for, by the bits of their times.
    frames: BTreeMap<u64, Vec<FrameId>>,
    has_history: bool,
}

impl FramesByTime {
    fn of<T>(builder: &MapBuilder, asked: &[(FrameKey, T)]) -> Self {
        let times = asked.iter().filter_map(|(key, _)| match key {
            FrameKey::Time(time) => Some((time.to_bits(), Vec::new())),
            FrameKey::Id(_) => None,
        });
        let mut frames: BTreeMap<u64, Vec<FrameId>> = times.collect();
        if !frames.is_empty() {
            for (id, timestamp, _) in builder.trajectory() {
                if let Some(found) = frames.get_mut(&timestamp.to_bits()) {
                    found.push(id);
                }
            }
        }
        let has_history = builder.config().history != HistoryConfig::None;
        Self { frames, has_history }
    }

    fn frame(&self, key: FrameKey) -> PyResult<FrameId> {
        let time = match key {
            FrameKey::Id(id) => return Ok(FrameId::new(id)),
            FrameKey::Time(time) => time,
        };
        match self.frames.get(&time.to_bits()).map(Vec::as_slice) {
            Some([frame]) => Ok(*frame),
            Some([_, ..]) => {
                Err(refused(format!("several frames were inserted at {time} s: name them by id")))
            }
            _ if !self.has_history => Err(dymlm::Error::NoHistory).or_raise(),
            _ => Err(unknown_frame(format!("no frame was inserted at {time} s"))),
        }
    }
}
