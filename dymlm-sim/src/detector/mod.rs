//! What a 2D detector makes of the exact masks.

mod config;
mod model;

pub use config::{DetectionRates, DetectorConfig};
pub(crate) use model::{Detector, Visible, visible_things};
