//! A simulated 2D detector: turns exact masks into boxes with a detector's errors.

mod config;
mod model;

pub use config::{DetectionRates, DetectorConfig};
pub(crate) use model::{Detector, Visible, visible_things};
