use std::sync::Arc;

use dymlm_core::Pages;

use super::merged_log::MergedLog;
use crate::session_log::Event;
use crate::{Error, MapConfig, MultiLevelMap};

/// Maps, and the first events of a merged log, which have already happened in them.
pub(super) type Beginning = (MultiLevelMap, Pages<Event>);

impl MergedLog {
    /// The map whose sessions come first in the log (of two such maps the one with most events), else empty
    /// maps: what has happened in it need not happen again.
    pub(super) fn known_beginning(
        &self,
        maps: [Option<&MultiLevelMap>; 2],
        config: &Arc<MapConfig>,
    ) -> Result<Beginning, Error> {
        let known = maps.into_iter().enumerate();
        let known = known.filter_map(|(side, map)| Some((self.known_events(side, map?)?, map?)));
        match known.max_by_key(|(events, _)| events.len()) {
            Some((events, map)) => Ok((map.without_past(), events)),
            None => Ok((MultiLevelMap::new(config)?, Pages::default())),
        }
    }

    /// The first events of the log, when they are exactly those that have made a map as it is.
    fn known_events(&self, side: usize, map: &MultiLevelMap) -> Option<Pages<Event>> {
        let log = map.past.log.as_ref().filter(|_| !map.past.differs_from_log)?;
        let own = log.logged_sessions();
        let merged = self.log.logged_sessions();
        let own_first = own.iter().zip(&self.sessions).zip(&merged).all(|((logged, session), merged)| {
            let clock_offsets = [
                log.frames.get(logged.frames.start).map(|frame| frame.clock_offset),
                self.log.frames.get(merged.frames.start).map(|frame| frame.clock_offset),
            ];
            session.places[side].as_ref() == Some(logged)
                && (merged.frames.len(), merged.events.len()) == (logged.frames.len(), logged.events.len())
                && clock_offsets[0] == clock_offsets[1]
        });
        if own.len() > merged.len() || !own_first {
            return None;
        }
        let length = own.len().checked_sub(1).and_then(|last| merged.get(last)).map_or(0, |it| it.events.end);
        let mut events = self.log.events.first(length);
        for place in &self.event_places[side] {
            // With the ids that things have in that map.
            let seen = log.events.get(place.before).and_then(Event::key_frame).map(|entry| &entry.seen);
            let entry = events.get_mut(place.merged).and_then(Event::key_frame_mut);
            if let Some((entry, seen)) = entry.zip(seen) {
                entry.seen.clone_from(seen);
            }
        }
        Some(events)
    }
}
