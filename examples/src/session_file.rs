use std::path::Path;

use dymlm::MultiLevelMap;
use dymlm::core::Pose;
use dymlm::files::SessionRecorder;
use dymlm_io::McapWriterOptions;

use crate::{AnyError, SourceFrame};

/// Seconds of the session between two states of the maps.
const INTERVAL: f64 = 1.0;

/// Records a run for viewers: the frames, and the maps once a second and at the end.
#[derive(Debug)]
pub struct SessionFile {
    recorder: SessionRecorder,
    /// Up, until the maps have learnt it.
    about_up: [f64; 3],
    /// Time of the last frame, and of the last state of the maps.
    frame_time: f64,
    map_time: f64,
}

impl SessionFile {
    /// Begins a file (`.mcap`). `about_up` is the direction of labels and of the grid as long as the maps do
    /// not know which way is up.
    ///
    /// # Errors
    ///
    /// When the file cannot be written.
    pub fn create(path: &Path, about_up: [f64; 3]) -> Result<Self, AnyError> {
        let recorder = SessionRecorder::create(path, &McapWriterOptions::default())?;
        Ok(Self { recorder, about_up, frame_time: 0.0, map_time: f64::NEG_INFINITY })
    }

    /// Records a frame that was mapped from a pose, and the maps when a second has gone by.
    ///
    /// # Errors
    ///
    /// When the file cannot be written.
    pub fn record(
        &mut self,
        next: &SourceFrame,
        world_from_camera: &Pose,
        map: &MultiLevelMap,
    ) -> Result<(), AnyError> {
        self.recorder.record_frame(&next.frame, next.detections.as_deref(), world_from_camera)?;
        self.frame_time = next.frame.timestamp();
        if self.frame_time - self.map_time >= INTERVAL {
            self.record_map(map)?;
            self.map_time = self.frame_time;
        }
        Ok(())
    }

    fn record_map(&mut self, map: &MultiLevelMap) -> Result<(), AnyError> {
        self.recorder.set_up(map.up().unwrap_or(self.about_up));
        Ok(self.recorder.record_map(self.frame_time, map)?)
    }

    /// Records the final maps and completes the file.
    ///
    /// # Errors
    ///
    /// When the file cannot be written.
    pub fn finish(mut self, map: &MultiLevelMap) -> Result<(), AnyError> {
        self.record_map(map)?;
        Ok(self.recorder.finish()?)
    }
}
