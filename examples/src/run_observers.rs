use dymlm::core::Pose;
use dymlm::{FrameReport, MapBuilder};

use crate::{AnyError, RunRecorder, SessionFile, SourceFrame};

/// The optional observers of a run while its maps are built.
#[derive(Debug, Default)]
pub struct RunObservers {
    /// Records the data of the report page.
    pub report: Option<RunRecorder>,
    /// Writes frames and maps for viewers.
    pub session: Option<SessionFile>,
}

impl RunObservers {
    /// Passes an inserted frame and its pose to all observers.
    ///
    /// # Errors
    ///
    /// When the session file cannot be written; recording then stops, and the run can go on.
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
