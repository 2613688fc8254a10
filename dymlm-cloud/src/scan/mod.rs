//! Scans: points of a lidar or of any other sensor that is no camera.

mod block_index;
mod cell_set;
mod incidence;
mod insertion;
mod scan_rays;

use dymlm_core::{Point, Pose};

pub(crate) use scan_rays::ScanRays;

/// Points that a sensor has read at one time.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Scan<'a> {
    /// Seconds.
    pub(crate) timestamp: f64,
    /// In the sensor's frame, metres.
    pub(crate) points: &'a [Point],
    pub(crate) world_from_sensor: &'a Pose,
}
