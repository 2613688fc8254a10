//! What a structured-light camera makes of the exact depth.

mod config;
mod model;

pub use config::SensorConfig;
pub(crate) use model::{Places, Sensor};
