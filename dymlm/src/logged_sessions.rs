use std::collections::BTreeMap;
use std::ops::Range;

use dymlm_core::FrameId;

use crate::MultiLevelMap;
use crate::session_log::{Event, InsertedFrame, SessionLog};

/// A session that maps were built in.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct MapSession {
    /// Its first frame or scan.
    pub first: FrameId,
    /// Its number of frames and scans, whose ids are consecutive.
    pub frames: usize,
    /// Times of the first and the last one on the maps' clock, seconds. Where a session's own clock begins
    /// before the end of the session before, its times are shifted to follow that.
    pub times: [f64; 2],
}

impl MultiLevelMap {
    /// The sessions that the maps were built in, in their order; none without a
    /// [history](crate::MapConfig::history).
    pub fn sessions(&self) -> Vec<MapSession> {
        let Some(log) = &self.past.log else { return Vec::new() };
        let sessions = log.logged_sessions().into_iter().filter_map(|logged| {
            let time = |frame: usize| log.frames.get(frame).map(InsertedFrame::map_time);
            Some(MapSession {
                first: FrameId::new(logged.frames.start as u64),
                frames: logged.frames.len(),
                times: [time(logged.frames.start)?, time(logged.frames.end.checked_sub(1)?)?],
            })
        });
        sessions.collect()
    }
}

/// A session of a log.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "io", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct Session {
    /// Its first frame.
    pub(crate) first: FrameId,
    /// Time of that frame on the clock of the maps that recorded it, seconds. It gives the session its place
    /// among others, even if sessions that are merged later come before it.
    pub(crate) start: f64,
    /// Hash of what its first key frame or scan with a reading has read; 0 before that. Of two recordings
    /// that began at the same time, it tells which comes first, and whether both are one. It stays when that
    /// key frame is mended or removed, so that both versions of the session are known as one.
    pub(crate) content: u64,
}

/// Where a session is in a log.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct LoggedSession {
    pub(crate) start: f64,
    pub(crate) content: u64,
    /// Ids of its frames.
    pub(crate) frames: Range<usize>,
    /// Places of its events, without the event that says that it began.
    pub(crate) events: Range<usize>,
    /// How many of its last events say that a further session began in which nothing has happened yet.
    pub(crate) begun_after: usize,
}

impl LoggedSession {
    /// Number of events that happened in the session itself.
    pub(crate) fn own_events(&self) -> usize {
        self.events.len() - self.begun_after
    }
}

impl Session {
    /// Notes what a key frame or scan has read, if it is the session's first.
    pub(crate) fn note_content(&mut self, numbers: impl Iterator<Item = u32>) {
        if self.content == 0 {
            // FNV-1a, by numbers instead of bytes.
            self.content = numbers.fold(0xcbf2_9ce4_8422_2325, |hash, number| {
                (hash ^ u64::from(number)).wrapping_mul(0x0100_0000_01b3)
            });
        }
    }
}

impl SessionLog {
    /// The sessions in their order. What happened before any frame came belongs to the first session, and
    /// what happened in a session without frames to the session before.
    pub(crate) fn logged_sessions(&self) -> Vec<LoggedSession> {
        let mut begins: BTreeMap<FrameId, usize> = BTreeMap::new();
        for (place, event) in self.events.iter().enumerate() {
            if let Event::SessionBegan { first: Some(first) } = event {
                // The last such event: before it, sessions may have begun in which no frame came.
                begins.insert(*first, place);
            }
        }
        let begin = |session: &Session| begins.get(&session.first).copied();
        let nexts = self.sessions.iter().skip(1).map(Some).chain([None]);
        let (mut logged, mut start) = (Vec::with_capacity(self.sessions.len()), 0);
        for (session, next) in self.sessions.iter().zip(nexts) {
            let frames_end = next.map_or(self.frames.len(), |next| next.first.get() as usize);
            let end = next.map_or(self.events.len(), |next| begin(next).unwrap_or(start));
            let frames = session.first.get() as usize..frames_end;
            let is_begin =
                |place: &usize| matches!(self.events.get(*place), Some(Event::SessionBegan { .. }));
            let begun_after = (start..end).rev().take_while(is_begin).count();
            let &Session { start: began, content, .. } = session;
            logged.push(LoggedSession { start: began, content, frames, events: start..end, begun_after });
            start = end + 1;
        }
        logged
    }
}
