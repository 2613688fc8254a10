//! What a depth camera makes of the exact depth.

mod config;
mod model;

pub use config::SensorConfig;
pub(crate) use model::{Places, Sensor};
