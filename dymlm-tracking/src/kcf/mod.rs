//! Kernelized correlation filter: where a target's window has moved in the image.

mod alignment;
mod channels;
mod config;
mod correlation;
mod fhog;
mod fourier;
mod peak;
mod tracker;
mod window;

pub use config::KcfConfig;
pub use tracker::{KcfTracker, KcfUpdate};
