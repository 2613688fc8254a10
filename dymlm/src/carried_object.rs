use dymlm_core::{Frame, FrameId, ObjectId, PlaneId, Point, Pose};
use dymlm_geometry::OrientedBox;
use dymlm_objects::{MapObject, ShapeKind};
use dymlm_tracking::{ObjectModel, ObjectState, ObjectTracker, ObjectTrackerConfig, ObjectUpdate};

use crate::session_log::{BodyMotion, Event};
use crate::witnesses::Witnesses;
use crate::{Error, MapBuilder, MultiLevelMap};

/// Rim around an object within which readings may belong to it (noise, mixed pixels), metres: narrow when it
/// rests and the maps change, wider while it moves and readings are only left out.
const RIM_AT_REST: f64 = 0.02;
const RIM_WHILE_MOVING: f64 = 0.04;
/// Points lower than this above the plane that the object stood on belong to the plane, metres.
const CLEARANCE: f64 = 0.007;

/// An object was put down at another place, and all maps followed.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct ObjectMove {
    /// The object.
    pub object: ObjectId,
    /// Its box where it stood before.
    pub from: OrientedBox,
    /// Its box where it stands now.
    pub to: OrientedBox,
    /// Voxels of the cloud that moved with it.
    pub cloud_voxels: usize,
    /// Cells of the octree that are free now.
    pub emptied_cells: usize,
    /// Cells of the octree that became occupied at its new place.
    pub occupied_cells: usize,
    /// Planes that are its faces.
    pub planes: Vec<PlaneId>,
}

/// What is remembered of an object that is followed, at rest or carried.
#[derive(Debug, Clone, Default)]
pub(crate) struct Followed {
    /// While somebody carries it: its box in the next frame, with a rim, in the world; none once that frame
    /// has come.
    pub(crate) body: Option<OrientedBox>,
    /// The key frame from which the log knows where it was put down last; none before, or without a history.
    put_down_by: Option<FrameId>,
    /// From its last place as its tracker has it to where the maps have it. A correction moves the former
    /// with the newest frame, by which the tracker is told, and the latter with the frames that saw it there.
    map_from_tracker: Pose,
}

impl Followed {
    /// Follows a correction that has moved frames by `motion` and the newest frame by `newest`, if at all;
    /// `seen_by` is the last key frame that has seen the object in its place.
    pub(crate) fn follow(
        &mut self,
        seen_by: Option<FrameId>,
        motion: impl Fn(FrameId) -> Option<Pose>,
        newest: Option<Pose>,
    ) {
        let or_stays = |motion: Option<Pose>| motion.unwrap_or_else(Pose::identity);
        if let Some(frame) = seen_by.max(self.put_down_by) {
            let tracker_motion = or_stays(newest);
            self.map_from_tracker =
                or_stays(motion(frame)) * self.map_from_tracker * tracker_motion.inverse();
        }
        if let Some((body, new_from_old)) = self.body.as_mut().zip(newest) {
            *body = body.transformed(&new_from_old);
        }
    }
}

/// Objects of the map that somebody carries about (the paper's section V-D).
impl MapBuilder {
    /// Makes a tracker for an object of the map, from a frame in which the object stands where the map has
    /// it.
    ///
    /// The tracker's object frame is the object's box: origin in its middle, axes along its sides. Cuboids
    /// are followed by their box, other things by their points. The tracker is the caller's: where poses are
    /// corrected, it must be told ([`ObjectTracker::move_world`]). It takes the place of any earlier tracker
    /// of the object.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownObject`]; [`Error::Tracking`] when it is not seen in the frame or the settings are
    /// refused.
    pub fn track_object(
        &mut self,
        object: ObjectId,
        frame: &Frame,
        world_from_camera: &Pose,
        config: &ObjectTrackerConfig,
    ) -> Result<ObjectTracker, Error> {
        let mapped = self.map.objects().object(object).ok_or(Error::UnknownObject { object })?;
        let world_from_object = mapped.oriented_box().world_from_box();
        let model = model_of(mapped)?;
        let label = Some(mapped.label());
        let sensor = self.config.sensor;
        let tracker =
            ObjectTracker::new(frame, world_from_camera, model, label, &world_from_object, sensor, config)?;
        // Whatever an earlier tracker of it believed, this one begins where the maps have it.
        self.followed.remove(&object);
        Ok(tracker)
    }

    /// Tells the maps what the tracker of an object has found in a frame; call it before
    /// [`insert`](Self::insert)ing that frame, once for each object that is followed.
    ///
    /// While the object moves, its pixels are kept out of the maps, and the object map shows it where it
    /// stood. Once it has come to rest, the object stands at its new pose and its old place is empty in all
    /// maps: its points of the cloud go with it, the octree's cells that held it are free, planes that were
    /// its faces go with it, and the object itself keeps its id and all that is known of it. Where older
    /// frames still wait for their detections, all of that happens before they are mapped.
    ///
    /// ```no_run
    /// # use dymlm::{MapBuilder, core::{Detection, Frame, Pose}, tracking::ObjectTrackerConfig};
    /// # fn next() -> Option<(Frame, Vec<Detection>, Pose)> { None }
    /// # fn run(mut builder: MapBuilder, frame: &Frame, pose: &Pose) -> Result<(), dymlm::Error> {
    /// let Some(book) = builder.map().objects().with_label("book").next() else { return Ok(()) };
    /// let object = book.id();
    /// let mut tracker = builder.track_object(object, frame, pose, &ObjectTrackerConfig::default())?;
    /// while let Some((frame, detections, pose)) = next() {
    ///     let update = tracker.track(&frame, &detections, &pose)?;
    ///     if let Some(moved) = builder.follow_object(object, &tracker, &update)? {
    ///         // moved.from is empty now, the object stands at moved.to.
    ///     }
    ///     builder.insert(&frame, &detections, &pose)?;
    /// }
    /// # Ok(()) }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::UnknownObject`]; [`Error::Planes`] when the object was put down outside what the maps can
    /// reach. The maps stay as they were then, and have it at its old place until it is put down within their
    /// reach.
    pub fn follow_object(
        &mut self,
        object: ObjectId,
        tracker: &ObjectTracker,
        update: &ObjectUpdate,
    ) -> Result<Option<ObjectMove>, Error> {
        if self.map.objects().object(object).is_none() {
            self.followed.remove(&object);
            return Err(Error::UnknownObject { object });
        }
        let moved = match &update.came_to_rest {
            Some(rest) => {
                let known = self.followed.get(&object);
                let moved_from = known.map_or(rest.moved_from, |it| it.map_from_tracker * rest.moved_from);
                let new_from_old = rest.world_from_object * moved_from.inverse();
                let tracked = body_at(tracker, &moved_from, RIM_AT_REST);
                let moved = self.put_down(object, BodyMotion { new_from_old, tracked });
                if moved.is_err() {
                    // The tracker goes on from there, the maps from where they have it still.
                    let followed = self.followed.entry(object).or_default();
                    followed.map_from_tracker = new_from_old.inverse();
                }
                Some(moved?)
            }
            None => None,
        };
        let is_carried = update.state != ObjectState::AtRest;
        self.set_held(object, is_carried);
        if moved.is_some() {
            // Now the maps have it where its tracker has it.
            let put_down_by = self.newest_mapped().map(|(frame, _)| frame);
            self.followed.insert(object, Followed { put_down_by, ..Followed::default() });
        }
        let body = || body_at(tracker, &update.world_from_object, RIM_WHILE_MOVING);
        self.followed.entry(object).or_default().body = is_carried.then(body).flatten();
        Ok(moved)
    }

    /// Ends the carrying of an object that is not followed any more, as where its carrier has left with it: the
    /// map has it where it stood when it was taken up, and frames judge that again. Where they look through that
    /// place it is removed. Does nothing for an object that nobody carries. Without a release, a carried object
    /// stays in the map, and what is put in its place is an object of its own once that has been free.
    ///
    /// # Errors
    ///
    /// [`Error::UnknownObject`].
    pub fn release_object(&mut self, object: ObjectId) -> Result<(), Error> {
        if self.map.objects().object(object).is_none() {
            return Err(Error::UnknownObject { object });
        }
        self.followed.remove(&object);
        self.set_held(object, false);
        Ok(())
    }

    /// The last key frame in the log that has seen an object. O(key frames since).
    pub(crate) fn last_seen(&self, object: ObjectId) -> Option<FrameId> {
        let objects = self.map.objects();
        let is_it = |id: ObjectId| objects.current_id(id) == objects.current_id(object);
        let mut entries = self.map.past.log.as_ref()?.key_frames().rev();
        entries.find(|entry| entry.seen.objects.iter().any(|&(_, id)| is_it(id))).map(|entry| entry.frame)
    }

    /// Notes whether somebody carries an object.
    pub(crate) fn set_held(&mut self, object: ObjectId, is_held: bool) {
        let objects = &mut self.map.objects;
        let is_new = if is_held { objects.hold(object) } else { objects.release(object) };
        if is_new {
            let event = self.witnesses_of(object).map(|object| Event::Held { object, is_held });
            self.note(event);
        }
    }

    /// Moves an object to where it was put down, and logs the event.
    pub(crate) fn put_down(&mut self, object: ObjectId, mut motion: BodyMotion) -> Result<ObjectMove, Error> {
        let mut event = None;
        if let Some(((newest, world_from_camera), object)) =
            self.newest_mapped().zip(self.witnesses_of(object))
        {
            let in_camera = motion.seen_from(&world_from_camera.inverse());
            motion = in_camera.seen_from(&world_from_camera);
            event = Some(Event::Moved { newest, object, motion: Box::new(in_camera) });
        }
        let moved = self.map.move_body(object, &motion)?;
        self.note(event);
        self.publish_change();
        Ok(moved)
    }

    /// The detections by which the log identifies an object.
    fn witnesses_of(&self, object: ObjectId) -> Option<Witnesses> {
        self.map.past.log.as_ref().map(|log| Witnesses::of(object, &log.events, self.map.objects()))
    }
}

impl MultiLevelMap {
    /// Moves an object that was put down to its new place in all maps.
    pub(crate) fn move_body(&mut self, object: ObjectId, motion: &BodyMotion) -> Result<ObjectMove, Error> {
        let new_from_old = &motion.new_from_old;
        let mapped = self.objects().object(object).ok_or(Error::UnknownObject { object })?;
        let from = mapped.oriented_box();
        let support = mapped.support();
        let places: Vec<OrientedBox> = from.with_rim(RIM_AT_REST).into_iter().chain(motion.tracked).collect();
        let is_body = |place: [f64; 3]| {
            places.iter().any(|body| body.contains(place))
                && support.is_none_or(|support| support.plane.signed_distance(place) > CLEARANCE)
        };

        // First, because only the plane map may refuse: it does not reach as far as the others.
        self.planes.check_reach(&from.transformed(new_from_old).world_from_box())?;
        let planes = self.planes.move_body(new_from_old, is_body)?;
        let around =
            OrientedBox::around(&places).and_then(|around| around.with_rim(self.octree.resolution()).ok());
        let around = around.unwrap_or(from);
        let cloud = self.cloud.move_body(&around, new_from_old, is_body);
        let stayed = self.cloud.static_points_in(&around);
        let octree = self.octree.move_body(&cloud.from, &cloud.to, &stayed);
        let to = self.objects.move_object(object, new_from_old).ok_or(Error::UnknownObject { object })?;
        Ok(ObjectMove {
            object,
            from,
            to,
            cloud_voxels: cloud.from.len(),
            emptied_cells: octree.emptied,
            occupied_cells: octree.occupied,
            planes,
        })
    }
}

/// The surface by which an object of the map is followed, in the frame of its box.
fn model_of(object: &MapObject) -> Result<ObjectModel, Error> {
    let oriented_box = object.oriented_box();
    if object.shape().kind() == ShapeKind::Cuboid {
        return Ok(ObjectModel::cuboid(oriented_box.lengths())?);
    }
    let object_from_world = oriented_box.world_from_box().inverse();
    let points: Vec<Point> =
        object.points().map(|point| object_from_world.transform_point(point).map(|c| c as f32)).collect();
    Ok(ObjectModel::from_points(&points)?)
}

/// The box of a tracked object at a pose, wider by a rim on each side.
fn body_at(tracker: &ObjectTracker, world_from_object: &Pose, rim: f64) -> Option<OrientedBox> {
    let [low, high] = tracker.model().bounds();
    let body = OrientedBox::between(low, high).and_then(|body| body.with_rim(rim)).ok()?;
    Some(body.transformed(world_from_object))
}

#[cfg(test)]
mod tests {
    use dymlm_core::PinholeCamera;
    use dymlm_history::HistoryConfig;
    use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame};

    use super::*;
    use crate::common::poses;
    use crate::{Detections, MapConfig};

    fn frames(count: usize) -> Vec<SimulatedFrame> {
        let mut config = SequenceConfig::default();
        (config.frames, config.people) = (5 * count, 0);
        config.camera = Some(PinholeCamera::new(320, 240, 262.5, 262.5, 159.5, 119.5).unwrap());
        Sequence::new(&config).unwrap().frames().step_by(5).collect()
    }

    #[test]
    fn an_object_that_a_correction_loses_is_put_down_again_when_another_brings_it_back() {
        let mut config = MapConfig::default();
        (config.history, config.cloud.voxel_size) = (HistoryConfig::Memory, 0.02);
        let mut builder = MapBuilder::new(config).unwrap();
        let all = frames(8);
        let (last, shown) = all.split_last().unwrap();
        for frame in shown {
            builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
        }
        // The detector does not run on the last frame.
        builder.insert(&last.frame, Detections::NotRun, &last.world_from_camera).unwrap();
        builder.forget_outside(last.world_from_camera.translation(), 8.0);
        let object = builder.map().objects().objects().next().unwrap().id();
        let new_from_old = Pose::new([0.3, 0.2, 0.0], [0.0, 0.0, 0.6, 0.8]).unwrap();
        builder.put_down(object, BodyMotion { new_from_old, tracked: None }).unwrap();
        let (right, stands) = (poses(&builder), place(&builder, object).unwrap());

        // The first frames now show a region that was forgotten, however the world is moved afterwards.
        let far = Pose::new([30.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let wrong: Vec<_> = right[..shown.len()].iter().map(|&(id, pose)| (id, far * pose)).collect();
        let last = right[shown.len()];
        builder.correct_poses(&[wrong.as_slice(), &[last]].concat()).unwrap();
        assert_eq!(place(&builder, object), None);
        let turned = Pose::new([5.0, 1.0, 0.0], [0.0, 0.0, 0.8, 0.6]).unwrap();
        builder.transform(&turned).unwrap();
        builder.transform(&turned.inverse()).unwrap();

        builder.correct_poses(&right).unwrap();
        assert_eq!(place(&builder, object), Some(stands));
    }

    /// Where an object of the map stands.
    fn place(builder: &MapBuilder, object: ObjectId) -> Option<[f64; 3]> {
        builder.map().objects().object(object).map(|object| object.oriented_box().center())
    }
}
