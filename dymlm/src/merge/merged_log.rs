use dymlm_core::FrameId;

use super::session_union::{Source, UnitedSession, unite};
use crate::logged_sessions::Session;
use crate::session_clock::SessionClock;
use crate::session_log::{Event, InsertedFrame, SessionLog};
use crate::{Error, MergedSession};

/// The log of one builder that had taken in the sessions of two logs, one after the other.
pub(super) struct MergedLog {
    /// What its key frames have seen has the ids of the maps that the key frames come from.
    pub(super) log: SessionLog,
    pub(super) sessions: Vec<UnitedSession>,
    /// Where the events of each of the two logs are in this one.
    pub(super) event_places: [Vec<EventPlace>; 2],
    pub(super) newest: f64,
}

/// Place of an event in its own log, and in the merged one.
pub(super) struct EventPlace {
    pub(super) before: usize,
    pub(super) merged: usize,
}

impl MergedLog {
    pub(super) fn of(sources: [Source<'_>; 2]) -> Result<Self, Error> {
        let log = SessionLog::new(sources[0].log.history.emptied());
        let mut merged = Self {
            log,
            sessions: unite(sources),
            event_places: [Vec::new(), Vec::new()],
            newest: f64::NEG_INFINITY,
        };
        merged.add_frames(sources);
        // First, since what is added to a history's file stays there.
        merged.sessions.iter().try_for_each(|session| merged.check_same(session, sources))?;
        for index in 0..merged.sessions.len() {
            merged.add_events(index, sources)?;
        }
        Ok(merged)
    }

    /// The sessions as they are named in a report.
    pub(super) fn report(&self) -> Vec<MergedSession> {
        let sessions = self.sessions.iter().zip(self.log.logged_sessions());
        let first = |session: &UnitedSession, side: usize| {
            session.places[side].is_some().then(|| session.first_frame(side))
        };
        let report = sessions.map(|(session, merged)| MergedSession {
            first: FrameId::new(merged.frames.start as u64),
            frames: merged.frames.len(),
            own: first(session, 0),
            other: first(session, 1),
        });
        report.collect()
    }

    /// Adds all frames, on a clock that goes on from session to session.
    fn add_frames(&mut self, sources: [Source<'_>; 2]) {
        for session in &self.sessions {
            let (source, Some(logged)) = (&sources[session.side], session.logged()) else { continue };
            let mut clock = SessionClock::default();
            let first = FrameId::new(self.log.frames.len() as u64);
            self.log.sessions.push(Session { first, start: logged.start, content: logged.content });
            for frame in source.frames(logged) {
                let timestamp = frame.timestamp;
                let clock_offset = clock.advance(timestamp, self.newest);
                self.newest = timestamp + clock_offset;
                let world_from_camera = source.pose(frame);
                self.log.frames.push(InsertedFrame { timestamp, clock_offset, world_from_camera });
            }
        }
    }

    /// The merged log's id for a frame of one of the logs.
    fn frame(&self, side: usize, frame: FrameId) -> Result<FrameId, Error> {
        let before = frame.get() as usize;
        let sessions = self.sessions.iter().zip(&self.log.sessions);
        let mut places = sessions.filter_map(|(session, merged)| {
            let frames = &session.places[side].as_ref()?.frames;
            let offset = frames.contains(&before).then(|| before - frames.start)?;
            Some(FrameId::new(merged.first.get() + offset as u64))
        });
        places.next().ok_or(Error::UnknownFrame { frame })
    }

    /// Adds the events of a session.
    fn add_events(&mut self, index: usize, sources: [Source<'_>; 2]) -> Result<(), Error> {
        let side = self.sessions[index].side;
        if index > 0 {
            self.log.events.push(Event::SessionBegan { first: Some(self.log.sessions[index].first) });
        }
        let begin = self.log.events.len();
        for (logged, places) in self.sessions[index].places.iter().zip(&mut self.event_places) {
            let events = logged.iter().flat_map(|logged| logged.events.clone());
            places.extend(events.zip(begin..).map(|(before, merged)| EventPlace { before, merged }));
        }
        let session = &self.sessions[index];
        let Some(logged) = session.logged().cloned() else { return Ok(()) };
        // What the first log has of a session that went on longer in the other is in the merged history's
        // file already: a map into which another is merged again and again must not copy all of that each
        // time.
        let first = session.places[0].clone().filter(|_| side == 1);
        let mut known = first.iter().flat_map(|first| sources[0].own_events(first));
        for event in sources[side].events(&logged) {
            let mut event = self.renamed(side, event)?;
            let known = known.next().and_then(Event::observation);
            if let Some(observation) = event.observation_mut() {
                let (side, place) = known.map_or((side, *observation), |known| (0, known));
                *observation = self.log.history.push_from(&sources[side].log.history, place)?;
            }
            self.log.events.push(event);
        }
        Ok(())
    }

    /// An event of one of the logs, with the merged log's frame ids.
    fn renamed(&self, side: usize, event: &Event) -> Result<Event, Error> {
        let mut event = event.clone();
        event.rename_frames(&|frame| self.frame(side, frame))?;
        Ok(event)
    }

    /// Refuses a session whose contents differ in the two logs; but one of them may have gone on longer.
    fn check_same(&self, session: &UnitedSession, sources: [Source<'_>; 2]) -> Result<(), Error> {
        let [Some(own), Some(other)] = &session.places else { return Ok(()) };
        let differ = || Error::SessionsDiffer { own: session.first_frame(0), other: session.first_frame(1) };
        let [one, two] = sources;
        let frame = |source: Source<'_>, frame: &InsertedFrame| (frame.timestamp, source.pose(frame));
        let mut frames = one.frames(own).zip(two.frames(other));
        if frames.any(|(own, other)| frame(one, own) != frame(two, other)) {
            return Err(differ());
        }
        let shorter = 1 - session.side;
        let (Some(short), Some(long)) = (&session.places[shorter], session.logged()) else { return Ok(()) };
        if short.own_events() > long.own_events() {
            return Err(differ());
        }
        let [short_source, long_source] = [sources[shorter], sources[session.side]];
        for (event, known) in short_source.own_events(short).zip(long_source.events(long)) {
            let (event, known) = (self.renamed(shorter, event)?, self.renamed(session.side, known)?);
            let is_same = match (event.observation(), known.observation()) {
                (Some(one), Some(other)) => {
                    short_source.log.history.bytes(one)? == long_source.log.history.bytes(other)?
                }
                _ => true,
            };
            if !is_same || !event.is_like(&known) {
                return Err(differ());
            }
        }
        Ok(())
    }
}
