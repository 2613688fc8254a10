use dymlm::core::Pose;
use dymlm::{FrameReport, MapBuilder};

use crate::{AnyError, RunRecorder, SessionFile, SourceFrame};

/// What watches a run while its maps are built, as far as the caller asked for it.
#[derive(Debug, Default)]
pub struct RunObservers {
    /// Notes what the report page tells of the run.
    pub report: Option<RunRecorder>,
    /// Writes frames and maps for viewers.
    pub session: Option<SessionFile>,
}

impl RunObservers {
    /// Shows a frame that was inserted from a pose to all observers.
    ///
    /// # Errors
    ///
    /// When the session file cannot be written; the session is then dropped, the run is not concerned.
    pub fn record(
        &mut self,
        next: &SourceFrame,
        report: &FrameReport,
        world_from_camera: &Pose,
        builder: &MapBuilder,
    ) -> Result<(), AnyError> {
        if let Some(recorder) = &mut self.report {
            recorder.record(report, next.frame.camera(), world_from_camera, builder);
        }
        let session = self.session.as_mut();
        let recorded =
            session.map_or(Ok(()), |session| session.record(next, world_from_camera, builder.map()));
        if recorded.is_err() {
            self.session = None;
        }
        recorded
    }
}
