use std::cmp::Ordering;

use dymlm_core::{FrameId, Pose};

use crate::logged_sessions::LoggedSession;
use crate::session_log::{Event, InsertedFrame, SessionLog};

/// A log whose sessions are to be united with another's.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) log: &'a SessionLog,
    /// Takes its world to the merged one; none where both are the same, so that nothing is rounded.
    pub(super) world_from_log: Option<&'a Pose>,
}

/// A session of one log or of both.
pub(super) struct UnitedSession {
    /// The log that it is taken from.
    pub(super) side: usize,
    /// Its place in each log.
    pub(super) places: [Option<LoggedSession>; 2],
}

/// A session of one of the logs.
struct Candidate {
    side: usize,
    logged: LoggedSession,
}

impl Source<'_> {
    /// The pose of a frame in the merged world.
    pub(super) fn pose(&self, frame: &InsertedFrame) -> Pose {
        let pose = frame.world_from_camera;
        self.world_from_log.map_or(pose, |world_from_log| *world_from_log * pose)
    }

    /// The events of a session.
    pub(super) fn events(&self, session: &LoggedSession) -> impl Iterator<Item = &Event> {
        self.log.events.iter_from(session.events.start).take(session.events.len())
    }

    /// The events of a session without those of the next one's beginning.
    pub(super) fn own_events(&self, session: &LoggedSession) -> impl Iterator<Item = &Event> {
        self.events(session).take(session.own_events())
    }

    /// The frames of a session.
    pub(super) fn frames(&self, session: &LoggedSession) -> impl Iterator<Item = &InsertedFrame> {
        self.log.frames.iter_from(session.frames.start).take(session.frames.len())
    }
}

impl UnitedSession {
    /// Its place in the log that it is taken from.
    pub(super) fn logged(&self) -> Option<&LoggedSession> {
        self.places[self.side].as_ref()
    }

    /// Its first frame in one of the logs; frame 0 if it is not in that log.
    pub(super) fn first_frame(&self, side: usize) -> FrameId {
        FrameId::new(self.places[side].as_ref().map_or(0, |logged| logged.frames.start as u64))
    }
}

/// The sessions of both logs in the order of their start, each once. The order is the same whichever log is
/// the first, and whatever was merged before. A session that is in both logs is taken from the one in which
/// it went on longer, and from the first where it is the same in both.
pub(super) fn unite(sources: [Source<'_>; 2]) -> Vec<UnitedSession> {
    let mut candidates = Vec::new();
    for (side, source) in sources.iter().enumerate() {
        let sessions = source.log.logged_sessions();
        candidates.extend(sessions.into_iter().map(|logged| Candidate { side, logged }));
    }
    note_content(&mut candidates);
    candidates.sort_by(in_order);

    let same = candidates.chunk_by(|one, next| in_order(one, next).is_eq());
    same.map(united).collect()
}

/// A session of which nothing was mapped in one log is the one that began at the same time in the other: what its
/// first key frame has read was not known yet.
fn note_content(candidates: &mut [Candidate]) {
    let known: Vec<(f64, u64)> =
        candidates.iter().map(|known| (known.logged.start, known.logged.content)).collect();
    for Candidate { logged, .. } in candidates.iter_mut().filter(|unknown| unknown.logged.content == 0) {
        let same =
            known.iter().find(|(start, content)| *content != 0 && start.total_cmp(&logged.start).is_eq());
        logged.content = same.map_or(0, |(_, content)| *content);
    }
}

fn in_order(one: &Candidate, other: &Candidate) -> Ordering {
    let by_start = one.logged.start.total_cmp(&other.logged.start);
    by_start.then(one.logged.content.cmp(&other.logged.content))
}

/// One session, of one log or of both.
fn united(candidates: &[Candidate]) -> UnitedSession {
    let length =
        |Candidate { logged, .. }: &Candidate| (logged.frames.len(), logged.own_events(), logged.begun_after);
    // The last of equals is found.
    let longest = candidates.iter().rev().max_by_key(|candidate| length(candidate));
    let mut united = UnitedSession { side: longest.map_or(0, |longest| longest.side), places: [None, None] };
    for candidate in candidates {
        united.places[candidate.side] = Some(candidate.logged.clone());
    }
    united
}
