//! Finds the moving things of an RGB-D frame: box tracking, missed detections, box correction, static mask.
//!
//! The preprocessing of the multi-level map (paper section III-A), one named step a type:
//!
//! 1. [`BoxTracker`] follows the detector's boxes from frame to frame and predicts those it misses.
//! 2. [`ForegroundFinder`] finds the mover among the pixels of its box.
//! 3. [`MissCompensator`] decides by depth whether a predicted box still holds its mover.
//! 4. [`BoxCorrector`] widens boxes that cut a mover short.
//! 5. [`StaticMaskBuilder`] masks the movers' pixels.
//!
//! [`Preprocessor`] runs them in this order. Each works alone too: [`BoxTracker`] without depth and poses is a plain
//! SORT tracker.

mod box_corrector;
mod dynamics_config;
mod error;
mod foreground;
mod image_scale;
mod miss_compensation;
mod mover;
mod preprocessor;
mod static_mask;
mod tracking;

pub use box_corrector::{BoxCorrector, CorrectionConfig};
pub use dynamics_config::DynamicsConfig;
pub use error::Error;
pub use foreground::{Foreground, ForegroundConfig, ForegroundFinder, ForegroundSearch};
pub use miss_compensation::{CompensationConfig, MissCompensator};
pub use mover::Mover;
pub use preprocessor::{Preprocessed, Preprocessor};
pub use static_mask::{MaskConfig, MaskMode, MaskRegion, StaticMaskBuilder, mask_body};
pub use tracking::{BoxKalman, BoxSource, BoxTracker, TrackState, TrackedBox, TrackerConfig, View};
