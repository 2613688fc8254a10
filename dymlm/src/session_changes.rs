use dymlm_core::{Pages, Pose};
use dymlm_dynamics::Preprocessor;

use crate::key_frame_view::MappingContext;
use crate::replay::Replay;
use crate::snapshots::Snapshots;
use crate::{Error, MapSession, MultiLevelMap, WorldChanges};

/// What a session has found to differ from what the sessions before had found.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct SessionChanges {
    /// The session.
    pub session: MapSession,
    /// What it has found; ids are those of one builder that takes in all sessions.
    pub changes: WorldChanges,
}

impl MultiLevelMap {
    /// What each session but the first has found to have moved, appeared or vanished since the sessions
    /// before ([`world_changes_since`](Self::world_changes_since)), in their order. Costs the mapping of all
    /// key frames, without the search for movers and planes. Callers who still have the earlier maps compare
    /// them directly.
    ///
    /// # Errors
    ///
    /// [`Error::NoHistory`]; [`Error::History`] when an observation cannot be read.
    pub fn session_changes(&self) -> Result<Vec<SessionChanges>, Error> {
        let log = self.past.log.as_ref().ok_or(Error::NoHistory)?;
        let poses: Vec<Pose> = log.poses().collect();
        let preprocessor = Preprocessor::new(self.config.dynamics.clone(), self.config.sensor)?;
        let context =
            MappingContext { sensor: &self.config.sensor, mover_labels: preprocessor.mover_labels() };
        let mut snapshots = Snapshots::default();
        let map = Self::new(&self.config)?;
        let mut replay = Replay::new(log, &poses, map, Pages::default(), &mut snapshots)?;
        let mut before: Option<Self> = None;
        let mut found = Vec::new();
        for (session, logged) in self.sessions().into_iter().zip(log.logged_sessions()) {
            replay.run_to(logged.events.end, &context, &mut |_| true)?;
            let now = replay.map().clone();
            if let Some(before) = &before {
                found.push(SessionChanges { session, changes: now.world_changes_since(before) });
            }
            before = Some(now);
        }
        Ok(found)
    }
}
