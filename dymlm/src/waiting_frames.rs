use std::collections::VecDeque;

use dymlm_core::{Detection, Frame, FrameId, Pose};
use dymlm_geometry::OrientedBox;
use dymlm_objects::SightedPoint;

use crate::{Detections, Error, FrameInput};

/// Frames whose detector is still running, and all frames behind them, since movers are tracked in the order
/// of time.
///
/// They wait instead of being mapped and mended later (that is for detections that come too late: see
/// `late_detections.rs`). Waiting is exact: the maps are those that the detections would have made at once.
/// It costs the detector's latency, which is short compared with the time for which a map is used, and memory
/// for the frames of that time.
#[derive(Debug, Clone, Default)]
pub(crate) struct WaitingFrames {
    queue: VecDeque<WaitingFrame>,
}

/// A frame that waits, with its own copy of everything that was given with it.
#[derive(Debug, Clone)]
pub(crate) struct WaitingFrame {
    pub(crate) id: FrameId,
    pub(crate) frame: Frame,
    world_from_camera: Pose,
    sighted_points: Vec<SightedPoint>,
    /// Boxes of the carried objects in it, with a rim, in the world.
    pub(crate) carried: Vec<OrientedBox>,
    found: Awaited,
}

/// [`Detections`] that are owned.
#[derive(Debug, Clone)]
enum Awaited {
    Found(Vec<Detection>),
    NotRun,
    Pending,
}

impl WaitingFrames {
    /// Whether a frame that comes now has to wait.
    pub(crate) fn must_wait(&self, found: &Detections<'_>) -> bool {
        !self.queue.is_empty() || matches!(found, Detections::Pending)
    }

    /// Lets a frame wait.
    pub(crate) fn push(&mut self, id: FrameId, input: &FrameInput<'_>, carried: Vec<OrientedBox>) {
        let found = match input.found {
            Detections::Found(found) => Awaited::Found(found.to_vec()),
            Detections::NotRun => Awaited::NotRun,
            Detections::Pending => Awaited::Pending,
        };
        self.queue.push_back(WaitingFrame {
            id,
            frame: input.frame.clone(),
            world_from_camera: input.world_from_camera,
            sighted_points: input.sighted_points.to_vec(),
            carried,
            found,
        });
    }

    /// The frame whose detections are awaited.
    ///
    /// # Errors
    ///
    /// [`Error::NotPending`] when no detections of this frame are awaited (any more).
    pub(crate) fn pending(&self, id: FrameId) -> Result<&WaitingFrame, Error> {
        let waiting = self.queue.iter().find(|waiting| waiting.id == id);
        waiting
            .filter(|waiting| matches!(waiting.found, Awaited::Pending))
            .ok_or(Error::NotPending { frame: id })
    }

    /// Brings the detections of a frame.
    pub(crate) fn resolve(&mut self, id: FrameId, found: &[Detection]) {
        if let Some(waiting) = self.queue.iter_mut().find(|waiting| waiting.id == id) {
            waiting.found = Awaited::Found(found.to_vec());
        }
    }

    /// Drops a frame. Frames behind it that wait for nothing else are then ready.
    pub(crate) fn remove(&mut self, id: FrameId) {
        self.queue.retain(|waiting| waiting.id != id);
    }

    /// All frames that wait, in their order.
    pub(crate) fn iter(&self) -> impl Iterator<Item = &WaitingFrame> {
        self.queue.iter()
    }

    /// Gives the waiting frames new poses, and moves the carried objects in them alike; `poses`: those of all
    /// frames, by id.
    pub(crate) fn take_over(&mut self, poses: &[Pose]) {
        for waiting in &mut self.queue {
            let Some(&pose) = poses.get(waiting.id.get() as usize) else { continue };
            let before = std::mem::replace(&mut waiting.world_from_camera, pose);
            if before != pose {
                let new_from_old = pose * before.inverse();
                waiting.carried.iter_mut().for_each(|body| *body = body.transformed(&new_from_old));
            }
        }
    }

    /// Stops waiting, when a frame or scan of a time comes, for the detections of frames more than `delay` seconds
    /// older: their detector counts as not run. The frame right before it goes on waiting unless no delay is
    /// allowed: where frames come seldom, or after a pause, its detector has had the time until now, but nobody
    /// has asked for what it found.
    pub(crate) fn give_up_before(&mut self, (newest, now): (FrameId, f64), delay: f64) {
        let is_spared = |waiting: &WaitingFrame| delay > 0.0 && waiting.id.get() + 1 == newest.get();
        let is_late =
            |waiting: &&mut WaitingFrame| waiting.frame.timestamp() < now - delay && !is_spared(waiting);
        self.queue.iter_mut().take_while(is_late).for_each(WaitingFrame::give_up);
    }

    /// The same for all frames.
    pub(crate) fn give_up(&mut self) {
        self.queue.iter_mut().for_each(WaitingFrame::give_up);
    }

    /// Takes out the next frame if it waits for nothing any more.
    pub(crate) fn pop_ready(&mut self) -> Option<WaitingFrame> {
        let is_ready = self.queue.front().is_some_and(|waiting| !matches!(waiting.found, Awaited::Pending));
        if is_ready { self.queue.pop_front() } else { None }
    }
}

impl WaitingFrame {
    fn give_up(&mut self) {
        if matches!(self.found, Awaited::Pending) {
            self.found = Awaited::NotRun;
        }
    }

    /// The frame as it was given.
    pub(crate) fn input(&self) -> FrameInput<'_> {
        let found = match &self.found {
            Awaited::Found(found) => Detections::Found(found),
            Awaited::NotRun => Detections::NotRun,
            Awaited::Pending => Detections::Pending,
        };
        FrameInput::new(&self.frame, found, &self.world_from_camera).with_sighted_points(&self.sighted_points)
    }
}
