use dymlm_core::FrameId;

use crate::session_log::SessionLog;

/// How the maps were made, over all sessions.
#[derive(Debug, Clone)]
pub(crate) struct Past {
    /// Number of frames and scans that were inserted.
    pub(crate) frames: u64,
    /// Time of the newest of them on the maps' clock, seconds.
    pub(crate) newest: f64,
    /// Whether the maps may differ from those that a replay of the log would give: planes and objects have
    /// kept ids from before a correction, or a map could not be loaded.
    pub(crate) differs_from_log: bool,
    /// The log, when a history is kept.
    pub(crate) log: Option<SessionLog>,
}

impl Default for Past {
    fn default() -> Self {
        Self { frames: 0, newest: f64::NEG_INFINITY, differs_from_log: false, log: None }
    }
}

impl Past {
    /// Gives the next frame its id.
    pub(crate) fn next_frame(&mut self) -> FrameId {
        let id = FrameId::new(self.frames);
        self.frames += 1;
        id
    }
}
