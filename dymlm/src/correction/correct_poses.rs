use std::collections::BTreeMap;
use std::sync::Arc;

use dymlm_core::vector3::dot;
use dymlm_core::{FrameId, Pages, Pose};

use super::new_poses::new_poses;
use super::rebuilt::{Rebuilt, Renaming};
use super::report::{CorrectionProgress, CorrectionReport};
use crate::key_frame_view::MappingContext;
use crate::replay::Replay;
use crate::session_log::{Event, InsertedFrame};
use crate::snapshots::{Snapshots, Steps};
use crate::{Error, MapBuilder, MultiLevelMap};

/// Maps that follow a SLAM's pose corrections, when a [history](dymlm_history::HistoryConfig) is kept.
impl MapBuilder {
    /// Moves frames to the poses that a loop closure or an optimization has found. Afterwards all four maps
    /// are, to the bit, those that the same observations would have made at the new poses. Planes and objects
    /// keep their ids, and the report says what has become of them.
    ///
    /// Any frames may be given, in any order. A frame between two given ones moves with both, more with the
    /// one nearer in time. Frames after the last given one move with it, and the next frame's pose must be
    /// one in the corrected world. Frames before the first given one stay. Trackers of carried objects follow by
    /// [`ObjectTracker::move_world`](dymlm_tracking::ObjectTracker::move_world), with the report's
    /// [`new_from_old`](CorrectionReport::new_from_old).
    ///
    /// The old maps stay until the new ones are complete. Key frames are mapped again without the search for
    /// movers and planes, and scans with them: from an earlier state of the maps, at most as many before the
    /// first one that moved as have come since, or 80 where corrections of the last thirty are rare. But earlier
    /// states take at most half of the cloud's memory, and those that would take more are dropped, all but one:
    /// where most of the cloud changes, as in a single room, an early correction maps the whole session again.
    ///
    /// ```no_run
    /// # use dymlm::{MapBuilder, core::{FrameId, Pose}};
    /// # fn closed(mut builder: MapBuilder, optimized: Vec<(FrameId, Pose)>) -> Result<(), dymlm::Error> {
    /// let report = builder.correct_poses(&optimized)?;
    /// for (plane, into) in &report.planes.merged {
    ///     // A wall that drift had doubled: its id leads to the other.
    ///     assert_eq!(builder.map().planes().current_id(*plane), Some(*into));
    /// }
    /// # Ok(()) }
    /// ```
    ///
    /// # Errors
    ///
    /// [`Error::NoHistory`]; [`Error::UnknownFrame`]; [`Error::History`] when an observation cannot be read;
    /// [`Error::Cloud`] and [`Error::Planes`] when a pose lies outside what the maps can reach,
    /// [`Error::Octree`] when at such a pose the rays of a frame or scan would pass too many cells;
    /// [`Error::Paging`] when the file of a [memory budget](crate::MapConfig::memory) cannot be made, written
    /// or read. Nothing has changed.
    #[doc(alias = "loop closure")]
    pub fn correct_poses(&mut self, poses: &[(FrameId, Pose)]) -> Result<CorrectionReport, Error> {
        self.correct_poses_watched(poses, &mut |_| true)
    }

    /// [`Self::correct_poses`] that reports its progress to `watch`, which returns whether to go on.
    ///
    /// # Errors
    ///
    /// As [`Self::correct_poses`]; [`Error::Cancelled`] when `watch` says no. Nothing has changed.
    pub fn correct_poses_watched(
        &mut self,
        poses: &[(FrameId, Pose)],
        watch: &mut dyn FnMut(CorrectionProgress) -> bool,
    ) -> Result<CorrectionReport, Error> {
        let log = self.map.past.log.as_ref().ok_or(Error::NoHistory)?;
        // Of several poses for one frame the last counts.
        let given: BTreeMap<FrameId, Pose> = poses.iter().copied().collect();
        if let Some(&frame) = given.keys().find(|frame| log.frame(**frame).is_none()) {
            return Err(Error::UnknownFrame { frame });
        }
        let given: Vec<(FrameId, Pose)> = given.into_iter().collect();
        let poses = new_poses(&log.frames, &given);
        self.correct_from(None, &poses, watch)
    }

    /// Takes a frame or a scan out of all maps, as if it had never been inserted. Costs what
    /// [`Self::correct_poses`] does, and nothing for a frame that is no key frame, since no map holds it. A
    /// frame that waits for its detections is dropped, and frames that waited for it alone are processed: the
    /// next call that processes frames reports them.
    ///
    /// # Errors
    ///
    /// As [`Self::correct_poses`].
    pub fn remove(&mut self, frame: FrameId) -> Result<CorrectionReport, Error> {
        let log = self.map.past.log.as_mut().ok_or(Error::NoHistory)?;
        if log.frame(frame).is_none() {
            return Err(Error::UnknownFrame { frame });
        }
        let is_it = |event: &Event| event.mapped() == Some(frame);
        let Some(place) = log.events.iter().position(is_it) else {
            self.waiting.remove(frame);
            self.released = self.process_ready()?;
            return Ok(CorrectionReport::unchanged(self.map.past.log.as_ref().ok_or(Error::NoHistory)?));
        };
        let before = log.events.clone();
        log.events = before.first(place);
        before.iter_from(place + 1).for_each(|event| log.events.push(event.clone()));
        let poses: Vec<Pose> = log.poses().collect();
        let report = self.correct_from(Some(place), &poses, &mut |_| true);
        if let Some(log) = &mut self.map.past.log {
            match (&report, before.get(place)) {
                (Ok(_), Some(Event::KeyFrame(entry))) => log.history.remove(entry.observation),
                (Ok(_), Some(Event::Scan(entry))) => log.history.remove(entry.points),
                (Ok(_), _) => {}
                (Err(_), _) => log.events = before,
            }
        }
        report
    }

    /// Moves the whole world: each point, and so each frame's pose, becomes `new_from_old` times what it was;
    /// a [given](dymlm_objects::ParameterizationConfig::up) direction up turns with it. Costs what
    /// [`Self::correct_poses`] does.
    ///
    /// # Errors
    ///
    /// As [`Self::correct_poses`].
    pub fn transform(&mut self, new_from_old: &Pose) -> Result<CorrectionReport, Error> {
        let log = self.map.past.log.as_ref().ok_or(Error::NoHistory)?;
        let poses: Vec<Pose> = log.poses().map(|pose| *new_from_old * pose).collect();
        let config = Arc::clone(&self.config);
        let has_turned = self.turn_given_up(new_from_old);
        // Earlier states have the other direction.
        let snapshots = has_turned.then(|| std::mem::replace(&mut self.snapshots, Snapshots::new()));
        // Maps in which no frame has moved yet are made anew, too.
        let report = self.correct_from(has_turned.then_some(0), &poses, &mut |_| true);
        if report.is_err() {
            self.config = config;
            if let Some(snapshots) = snapshots {
                self.snapshots = snapshots;
            }
        }
        report
    }

    /// Turns the direction that the config says is up, and returns whether there is another now. Where it
    /// stays what it is, as in a turn about it, rounding must not change it.
    fn turn_given_up(&mut self, new_from_old: &Pose) -> bool {
        let Some(up) = self.config.objects.parameterization.up else { return false };
        let turned = new_from_old.rotate(up);
        let has_turned = dot(up, turned) < (1.0 - 1e-12) * dot(up, up);
        if has_turned {
            Arc::make_mut(&mut self.config).objects.parameterization.up = Some(turned);
        }
        has_turned
    }

    /// The frames that were inserted, in the order of their ids, with their times and their poses as they are
    /// mapped now; none without a history.
    pub fn trajectory(&self) -> impl Iterator<Item = (FrameId, f64, Pose)> {
        let frames = self.map.past.log.iter().flat_map(|log| log.frames.iter()).zip(0..);
        frames.map(|(frame, id)| (FrameId::new(id), frame.timestamp, frame.world_from_camera))
    }

    /// Replays the session with each frame at its new pose, from the first event that differs: `changed`, or
    /// the first event of a frame that moved.
    pub(crate) fn correct_from(
        &mut self,
        changed: Option<usize>,
        poses: &[Pose],
        watch: &mut dyn FnMut(CorrectionProgress) -> bool,
    ) -> Result<CorrectionReport, Error> {
        let log = self.map.past.log.as_ref().ok_or(Error::NoHistory)?;
        let has_moved = |frame: FrameId| {
            log.frame(frame).map(|frame| frame.world_from_camera) != poses.get(frame.get() as usize).copied()
        };
        // A frame that is in no map any more may still be the one from which an event's place is known.
        let first_moved = log.events.iter().position(|event| event.frame().is_some_and(has_moved));
        let first_changed = first_moved.into_iter().chain(changed).min();
        // Frames that no map has seen have poses, too: who saves what is newer shall save them.
        let is_changed = first_changed.is_some() || log.poses().ne(poses.iter().copied());
        for waiting in self.waiting.iter() {
            self.check_pose(&waiting.frame, &poses[waiting.id.get() as usize])?;
        }
        let mut report = match first_changed {
            Some(first_changed) => self.rebuild(first_changed, poses, watch)?,
            None => CorrectionReport::unchanged(log),
        };
        report.new_from_old = self.take_over(poses);
        if is_changed {
            self.publish_change();
        }
        Ok(report)
    }

    /// Builds the maps again with each frame at its new pose, and goes on with them.
    fn rebuild(
        &mut self,
        first_changed: usize,
        poses: &[Pose],
        watch: &mut dyn FnMut(CorrectionProgress) -> bool,
    ) -> Result<CorrectionReport, Error> {
        let rebuilt = self.mapped_again(first_changed, poses, watch)?;
        let Self { map, config, .. } = self;
        let before = std::mem::replace(map, rebuilt.map);
        (map.revision, map.past) = (before.revision, before.past);
        map.past.differs_from_log = true;
        let log = map.past.log.as_mut().ok_or(Error::NoHistory)?;
        log.events = rebuilt.events;

        let before: Vec<Pose> = log.poses().collect();
        let mut report = CorrectionReport::unchanged(log);
        report.note_motions(log, config.sensor.max_depth, [&before, poses]);
        (report.planes, report.objects) = (rebuilt.planes, rebuilt.objects);
        Ok(report)
    }

    /// The maps with each frame at its new pose: replayed from the newest snapshot before the first event
    /// that has changed, else from empty maps. Later snapshots are dropped, and new ones taken.
    fn mapped_again(
        &mut self,
        first_changed: usize,
        poses: &[Pose],
        watch: &mut dyn FnMut(CorrectionProgress) -> bool,
    ) -> Result<Rebuilt, Error> {
        let Self { map: before, snapshots, config, preprocessor, .. } = self;
        let log = before.past.log.as_ref().ok_or(Error::NoHistory)?;
        let context = MappingContext { sensor: &config.sensor, mover_labels: preprocessor.mover_labels() };
        let steps = Steps::after(&log.events, first_changed);
        snapshots.note_correction(steps.count(log.events.iter_from(first_changed)));
        let later = snapshots.take_out_behind(first_changed);
        let start = match snapshots.newest() {
            Some(snapshot) => Ok((snapshot.map.clone(), snapshot.events.clone())),
            None => MultiLevelMap::new(config).map(|map| (map, Pages::default())),
        };
        let replayed = start
            .and_then(|(map, events)| Replay::new(log, poses, map, events, snapshots)?.run(&context, watch));
        if replayed.is_err() {
            snapshots.put_back(later);
        }
        let (map, events) = replayed?;
        Ok(Renaming { log, before, map, events }.finish())
    }

    /// Stores the new poses of the frames, and moves what is known of the last ones to the corrected world.
    /// Returns how the newest frame has moved.
    fn take_over(&mut self, poses: &[Pose]) -> Pose {
        let seen_by: Vec<Option<FrameId>> =
            self.followed.keys().map(|&object| self.last_seen(object)).collect();
        let Some(log) = &mut self.map.past.log else { return Pose::identity() };
        let motion = |id: FrameId| {
            let place = id.get() as usize;
            let (old, new) = (log.frames.get(place)?.world_from_camera, *poses.get(place)?);
            (old != new).then(|| new * old.inverse())
        };
        let given = log.frames.len().checked_sub(1).and_then(|newest| motion(FrameId::new(newest as u64)));
        // Preprocessor and key frames remember the frame that they were given last.
        let processed = self.processed.and_then(motion);
        for (followed, seen_by) in self.followed.values_mut().zip(seen_by) {
            followed.follow(seen_by, motion, given);
        }
        for (place, &world_from_camera) in poses.iter().enumerate() {
            // Pages of frames that have stayed are still shared with what others hold of the log.
            if let Some(&frame) = log.frames.get(place) {
                log.frames.update(place, InsertedFrame { world_from_camera, ..frame });
            }
        }
        self.waiting.take_over(poses);
        if let Some(new_from_old) = processed {
            self.preprocessor.move_world(&new_from_old);
            self.key_frames.move_world(&new_from_old);
        }
        given.unwrap_or_else(Pose::identity)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::common::poses;
    use crate::random_session::{FRAMES, Session, Step, moved};

    /// Regression: each correction copied the whole log, so that snapshots, readers and savers held it once
    /// more.
    #[test]
    fn what_came_before_the_corrected_frames_is_still_shared() {
        const SCANS: usize = 300;
        let steps = vec![Step::Frame { is_detector_run: true }; FRAMES];
        let mut builder = Session::run(&steps).builder;
        let start = builder.trajectory().last().map_or(0.0, |(_, time, _)| time);
        for scan in 0..SCANS {
            let points = [[2.0, 0.1 * (scan % 10) as f32, 0.5]; 3];
            builder.insert_scan(start + 0.1 * scan as f64, &points, &Pose::identity()).unwrap();
        }
        let [mut frames, mut events] = [0, 0];
        // The first correction has no snapshot to begin at.
        for metres in [0.1, 0.2] {
            let before = builder.map.past.log.clone().unwrap();
            let mut given = poses(&builder);
            let last = given.len() - 3;
            given[last..].iter_mut().for_each(|(_, pose)| *pose = moved(metres, 0.0) * *pose);
            builder.correct_poses(&given).unwrap();
            let log = builder.map.past.log.as_ref().unwrap();
            (frames, events) = (log.frames.len(), log.events.len());
            assert!(log.frames.unshared(&before.frames).all(|place| place >= 128), "{frames} frames");
            assert!(log.events.unshared(&before.events).all(|place| place >= 256), "{events} events");
        }
        assert_eq!([frames, events], [FRAMES + SCANS; 2]);

        let before = builder.map.past.log.clone().unwrap();
        builder.remove(FrameId::new(frames as u64 - 1)).unwrap();
        let log = builder.map.past.log.as_ref().unwrap();
        assert!(log.events.unshared(&before.events).all(|place| place >= 256));
    }
}
