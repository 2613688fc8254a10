//! A simulated depth camera: turns exact depth into readings with a sensor's errors.

mod config;
mod model;

pub use config::SensorConfig;
pub(crate) use model::{Places, Sensor};
