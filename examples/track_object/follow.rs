use std::path::Path;
use std::time::Instant;

use dymlm::core::{DepthImage, Detection, Frame, ObjectId, Pose};
use dymlm::geometry::OrientedBox;
use dymlm::tracking::{ObjectState, ObjectTracker, ObjectTrackerConfig};
use dymlm::{MapBuilder, ObjectMove};
use dymlm_examples::AnyError;
use dymlm_io::write_atomically;

use crate::errors::{Errors, Quantiles};
use crate::strip::Panel;

/// Follows a chosen object frame by frame, and keeps the data for the reports.
pub(crate) struct Follower {
    builder: MapBuilder,
    tracker: ObjectTracker,
    object: ObjectId,
    has_depth: bool,
    world_from_object: Pose,
    run: Followed,
    was_lost: bool,
}

/// The results of following an object.
pub(crate) struct Followed {
    pub(crate) label: String,
    /// Time and pose, world from object, of the frames with one.
    pub(crate) poses: Vec<(f64, Pose)>,
    pub(crate) errors: Option<Errors>,
    pub(crate) losses: usize,
    /// Number of frames in which it stood where it was last seen or put down.
    pub(crate) at_rest: usize,
    pub(crate) milliseconds: Vec<f64>,
    pub(crate) moves: Vec<ObjectMove>,
    pub(crate) panels: Vec<Panel>,
}

impl Follower {
    /// Chooses an object of the builder's map.
    pub(crate) fn new(
        mut builder: MapBuilder,
        object: ObjectId,
        frame: &Frame,
        world_from_camera: &Pose,
        has_depth: bool,
    ) -> Result<Self, AnyError> {
        let mapped = builder.map().objects().object(object).ok_or("no such object")?;
        let (label, start) = (mapped.label().to_owned(), mapped.oriented_box().world_from_box());
        let config = ObjectTrackerConfig::default();
        let tracker = builder.track_object(object, &seen(frame, has_depth)?, world_from_camera, &config)?;
        let run = Followed {
            label,
            poses: Vec::new(),
            errors: None,
            losses: 0,
            at_rest: 0,
            milliseconds: Vec::new(),
            moves: Vec::new(),
            panels: Vec::new(),
        };
        Ok(Self { builder, tracker, object, has_depth, world_from_object: start, run, was_lost: false })
    }

    /// Tracks the object into a frame, updates the maps, and maps the frame. Returns the pose, if there is
    /// one. `detections` is `None` when the detector did not run: the maps must not take that for a look
    /// that found nothing.
    pub(crate) fn step(
        &mut self,
        frame: &Frame,
        detections: Option<&[Detection]>,
        world_from_camera: &Pose,
    ) -> Result<Option<Pose>, AnyError> {
        let input = seen(frame, self.has_depth)?;
        let begin = Instant::now();
        let update = self.tracker.track(&input, detections.unwrap_or_default(), world_from_camera)?;
        self.run.milliseconds.push(1e3 * begin.elapsed().as_secs_f64());
        self.run.moves.extend(self.builder.follow_object(self.object, &self.tracker, &update)?);
        self.builder.insert(frame, detections, world_from_camera)?;

        let is_lost = update.state == ObjectState::Lost;
        self.run.losses += usize::from(is_lost && !self.was_lost);
        self.was_lost = is_lost;
        self.run.at_rest += usize::from(update.state == ObjectState::AtRest);
        self.world_from_object = update.world_from_object;
        let timestamp = frame.timestamp();
        // An object at rest is at its last place, even if it is not seen.
        let is_known = update.inliers > 0 || update.state == ObjectState::AtRest;
        let found = is_known.then_some(update.world_from_object);
        self.run.poses.extend(found.map(|pose| (timestamp, pose)));
        Ok(found)
    }

    /// Keeps a picture of the frame and of the map.
    pub(crate) fn picture(&mut self, caption: &'static str, frame: &Frame, world_from_camera: &Pose) {
        let [low, high] = self.tracker.model().bounds();
        let lengths = [0, 1, 2].map(|axis| high[axis] - low[axis]);
        let body = OrientedBox::new(self.world_from_object, lengths).ok();
        let objects = self.builder.map().objects();
        let trace: Vec<[f64; 3]> = self.run.poses.iter().map(|(_, pose)| pose.translation()).collect();
        let chosen = body.map(|body| (self.object, body));
        self.run.panels.push(Panel::new(caption, frame, world_from_camera, objects, chosen, &trace));
    }

    pub(crate) fn finish(mut self, errors: Option<Errors>) -> Followed {
        self.run.errors = errors;
        self.run
    }
}

impl Followed {
    /// Writes the object's poses in TUM format.
    pub(crate) fn write_poses(&self, path: &Path) -> Result<(), AnyError> {
        Ok(write_atomically(path, |out| -> Result<(), AnyError> {
            writeln!(out, "# timestamp tx ty tz qx qy qz qw (world from object)")?;
            for (timestamp, pose) in &self.poses {
                let ([x, y, z], [qx, qy, qz, qw]) = (pose.translation(), pose.quaternion());
                writeln!(out, "{timestamp:.6} {x:.6} {y:.6} {z:.6} {qx:.7} {qy:.7} {qz:.7} {qw:.7}")?;
            }
            Ok(())
        })?)
    }

    #[allow(clippy::print_stdout, reason = "a program for the terminal")]
    pub(crate) fn print(&self) {
        let frames = self.milliseconds.len();
        let time = Quantiles::of(self.milliseconds.clone());
        println!(
            "{}: a pose in {} of {frames} frames, at rest in {}, lost {} times; {:.1} ms a frame (median), {:.1} ms (95 %)",
            self.label,
            self.poses.len(),
            self.at_rest,
            self.losses,
            time.at(0.5),
            time.at(0.95)
        );
        if let Some(errors) = &self.errors {
            println!("  off the truth: {errors}");
        }
        for moved in &self.moves {
            let [from, to] = [moved.from, moved.to].map(|place| place.center());
            println!(
                "  put down: from ({:.2}, {:.2}, {:.2}) to ({:.2}, {:.2}, {:.2}); {} voxels of the cloud and {} planes \
                 went with it, {} cells of the octree are empty, {} occupied",
                from[0],
                from[1],
                from[2],
                to[0],
                to[1],
                to[2],
                moved.cloud_voxels,
                moved.planes.len(),
                moved.emptied_cells,
                moved.occupied_cells
            );
        }
        if self.moves.is_empty() {
            println!("  it was not put down at another place");
        }
    }
}

/// The frame, without its depth if the tracker must not use it.
pub(crate) fn seen(frame: &Frame, has_depth: bool) -> Result<Frame, AnyError> {
    if has_depth {
        return Ok(frame.clone());
    }
    let camera = frame.camera();
    let blank =
        DepthImage::new(camera.width(), camera.height(), vec![0.0; camera.width() * camera.height()])?;
    Ok(Frame::new(frame.timestamp(), *camera, blank, frame.color().cloned())?)
}
