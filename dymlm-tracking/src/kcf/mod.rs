//! Kernelized correlation filter: tracks a target's window in the image.

mod alignment;
mod channels;
mod config;
mod correlation;
mod fhog;
mod fourier;
mod lanes;
mod peak;
mod tracker;
mod transform;
mod window;

pub use config::KcfConfig;
pub use tracker::{KcfTracker, KcfUpdate};
