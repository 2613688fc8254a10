//! Finds the moving things of an RGB-D frame: box tracking, missed detections, box correction, static mask.
//!
//! The preprocessing of the multi-level map (paper section III-A). [`Preprocessor::process`] runs it, a step
//! a file:
//!
//! 1. `tracking` follows the detector's boxes from frame to frame and predicts those it misses.
//! 2. `foreground` finds the mover among the readings of its box.
//! 3. `miss_compensation` decides by depth whether a predicted box still holds its mover.
//! 4. `box_corrector` widens boxes that cut a mover short.
//! 5. `static_mask` masks the movers' pixels.
//!
//! [`BoxTracker`] works alone too: without depth and poses it is a plain SORT tracker.

mod box_corrector;
mod dynamics_config;
mod error;
mod foreground;
mod miss_compensation;
mod mover;
mod mover_labels;
mod preprocessor;
mod static_mask;
mod tracking;

use box_corrector::BoxCorrector;
use foreground::{Foreground, ForegroundFinder, ForegroundSearch};
use static_mask::{MaskRegion, StaticMaskBuilder, mask_body};

pub use dynamics_config::DynamicsConfig;
pub use error::Error;
pub use mover::Mover;
pub use preprocessor::{Preprocessed, Preprocessor};
pub use static_mask::{MaskConfig, MaskMode};
pub use tracking::{BoxKalman, BoxSource, BoxTracker, TrackState, TrackedBox, TrackerConfig, View};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
