use dymlm::core::Pose;
use dymlm::{FrameReport, MapBuilder};

use crate::{RunRecorder, SourceFrame};

/// What watches a run while its maps are built, as far as it was asked for.
#[derive(Debug, Default)]
pub struct RunObservers {
    /// Notes what the report page tells of the run.
    pub report: Option<RunRecorder>,
}

impl RunObservers {
    /// Shows a frame that was inserted from a pose to all of them.
    pub fn record(
        &mut self,
        next: &SourceFrame,
        report: &FrameReport,
        world_from_camera: &Pose,
        builder: &MapBuilder,
    ) {
        if let Some(recorder) = &mut self.report {
            recorder.record(report, next.frame.camera(), world_from_camera, builder);
        }
    }
}
