use dymlm_core::FrameId;

use crate::session_log::SessionLog;

/// How maps came about, in all sessions.
#[derive(Debug, Clone)]
pub(crate) struct Past {
    /// Frames and scans that were given.
    pub(crate) frames: u64,
    /// Time of the newest of them on the maps' clock, seconds.
    pub(crate) newest: f64,
    /// Whether planes and objects have ids of before a correction, and so others than the log would give
    /// them.
    pub(crate) keeps_older_ids: bool,
    /// What has happened, when a history is kept.
    pub(crate) log: Option<SessionLog>,
}

impl Default for Past {
    fn default() -> Self {
        Self { frames: 0, newest: f64::NEG_INFINITY, keeps_older_ids: false, log: None }
    }
}

impl Past {
    /// Names the next frame.
    pub(crate) fn next_frame(&mut self) -> FrameId {
        let id = FrameId::new(self.frames);
        self.frames += 1;
        id
    }
}
