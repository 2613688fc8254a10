//! Objects of the map that somebody carries.

use dymlm::ObjectMove;
use dymlm::core::{Detection, ObjectId};
use dymlm::tracking::{ObjectState, ObjectTracker, ObjectUpdate};
use pyo3::prelude::*;

use crate::detection::DetectionsArgument;
use crate::error::{OrRaise, refused};
use crate::exclusive::Exclusive;
use crate::frame::PyFrame;
use crate::pose::{PoseArgument, PyPose};

/// Follows an object of the map while somebody carries it, in six degrees of freedom. Made by
/// `MapBuilder.track_object`.
#[pyclass(frozen, name = "ObjectTracker", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyObjectTracker {
    pub(crate) object: ObjectId,
    /// With its result of the last frame: both are always of the same frame.
    tracker: Exclusive<(ObjectTracker, Option<ObjectUpdate>)>,
}

#[pymethods]
impl PyObjectTracker {
    /// The object's id in the map.
    #[getter]
    fn object(&self) -> u64 {
        self.object.get()
    }

    /// Finds the object in the next Frame, which needs colours. Returns an ObjectUpdate.
    fn track(&self, py: Python<'_>, frame: &Bound<'_, PyFrame>) -> PyResult<PyObjectUpdate> {
        let frame = frame.get();
        let found: &[Detection] = match &frame.found {
            DetectionsArgument::Found(found) => found,
            _ => &[],
        };
        let track = |(tracker, last): &mut (ObjectTracker, Option<ObjectUpdate>)| {
            let update = tracker.track(&frame.frame, found, &frame.world_from_camera)?;
            let told = PyObjectUpdate::of(&update);
            *last = Some(update);
            Ok::<_, dymlm::tracking::Error>(told)
        };
        self.tracker.with(py, track)?.or_raise()
    }

    /// Converts what is known of the object after the world was moved, as by `MapBuilder.correct_poses`: its
    /// report has `new_from_old`. Poses of later frames are in the new world. Track a frame before the builder is
    /// told of the object again.
    fn move_world(&self, py: Python<'_>, new_from_old: PoseArgument) -> PyResult<()> {
        self.tracker.with(py, |(tracker, last)| {
            tracker.move_world(&new_from_old.0);
            *last = None;
        })
    }
}

impl PyObjectTracker {
    pub(crate) fn of(object: ObjectId, tracker: ObjectTracker) -> Self {
        Self { object, tracker: Exclusive::new((tracker, None)) }
    }

    /// The tracker and its result of the last frame.
    pub(crate) fn last_found(&self, py: Python<'_>) -> PyResult<(ObjectTracker, ObjectUpdate)> {
        let (tracker, last) = self.tracker.with(py, |found| found.clone())?;
        Ok((tracker, last.ok_or_else(|| refused("the tracker has tracked no frame"))?))
    }
}

/// Where a carried object is in a frame.
#[pyclass(frozen, get_all, name = "ObjectUpdate", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyObjectUpdate {
    /// "at_rest", "tracking", "occluded", "lost" or "recovered".
    state: &'static str,
    /// Its pose; when `inliers` is 0, the last known pose or a prediction.
    world_from_object: PyPose,
    /// Number of points that agree on the pose.
    inliers: usize,
    /// Confidence in the pose, 0 to 1.
    confidence: f64,
    /// Whether it came to rest in this frame, at a new place.
    came_to_rest: bool,
}

impl PyObjectUpdate {
    fn of(update: &ObjectUpdate) -> Self {
        Self {
            state: match update.state {
                ObjectState::AtRest => "at_rest",
                ObjectState::Tracking => "tracking",
                ObjectState::Occluded => "occluded",
                ObjectState::Recovered => "recovered",
                _ => "lost",
            },
            world_from_object: PyPose(update.world_from_object),
            inliers: update.inliers,
            confidence: update.confidence,
            came_to_rest: update.came_to_rest.is_some(),
        }
    }
}

/// The move of an object that was put down at another place; all maps followed.
#[pyclass(frozen, get_all, name = "ObjectMove", module = "dymlm")]
#[derive(Debug)]
pub(crate) struct PyObjectMove {
    /// The object's id.
    object: u64,
    /// The frame of its box at the old place.
    old_world_from_object: PyPose,
    /// The frame of its box at the new place.
    world_from_object: PyPose,
    /// Number of voxels of the cloud that moved with it.
    cloud_voxels: usize,
    /// Number of cells of the octree that became free.
    emptied_cells: usize,
    /// Number of cells of the octree that became occupied.
    occupied_cells: usize,
    /// Ids of planes that are faces of it.
    planes: Vec<u64>,
}

impl PyObjectMove {
    pub(crate) fn of(moved: &ObjectMove) -> Self {
        Self {
            object: moved.object.get(),
            old_world_from_object: PyPose(moved.from.world_from_box()),
            world_from_object: PyPose(moved.to.world_from_box()),
            cloud_voxels: moved.cloud_voxels,
            emptied_cells: moved.emptied_cells,
            occupied_cells: moved.occupied_cells,
            planes: moved.planes.iter().map(|plane| plane.get()).collect(),
        }
    }
}
