use dymlm_core::FrameId;

use crate::Revision;
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
    /// Revision at which the maps were loaded: with it they are what some folder holds. The first one for maps
    /// that were not loaded.
    #[cfg_attr(not(feature = "io"), expect(dead_code, reason = "only files are asked for it"))]
    pub(crate) loaded: Revision,
    /// The log, when a history is kept.
    pub(crate) log: Option<SessionLog>,
}

impl Default for Past {
    fn default() -> Self {
        Self {
            frames: 0,
            newest: f64::NEG_INFINITY,
            differs_from_log: false,
            loaded: Revision::default(),
            log: None,
        }
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
