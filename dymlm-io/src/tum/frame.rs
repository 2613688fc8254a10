use std::path::PathBuf;

use dymlm_core::{Frame, Pose};

use crate::UncoveredTime;

/// One frame of a dataset, not loaded yet.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TumFrame {
    /// Time of the depth image, seconds: the frame's time.
    pub timestamp: f64,
    /// Time of the colour image, seconds, which is also the time of its detections.
    pub color_timestamp: Option<f64>,
    /// The depth image.
    pub depth: PathBuf,
    /// The colour image.
    pub color: Option<PathBuf>,
    /// The pose at the frame's time, or why there is none.
    pub world_from_camera: Result<Pose, UncoveredTime>,
    pub(super) depth_listing: Listing,
    pub(super) color_listing: Listing,
}

impl TumFrame {
    /// The time at which a detector has seen the frame.
    pub(super) fn seen_at(&self) -> f64 {
        self.color_timestamp.unwrap_or(self.timestamp)
    }
}

/// The place of an image in a list.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Listing {
    pub(super) list: &'static str,
    pub(super) line: usize,
}

/// A loaded frame and its camera pose.
#[derive(Debug, Clone, PartialEq)]
pub struct PosedFrame {
    /// The frame.
    pub frame: Frame,
    /// Takes camera coordinates to the world.
    pub world_from_camera: Pose,
}
