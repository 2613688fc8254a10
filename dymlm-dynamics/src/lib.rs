//! Finds the moving things of an RGB-D frame: box tracking, missed detections, box correction, static mask.
//!
//! The preprocessing of the multi-level map (paper section III-A). [`Preprocessor::process`] runs it, a step
//! a file:
//!
//! 1. `tracking` follows the detector's boxes from frame to frame and predicts those it misses.
//! 2. `foreground` finds the mover among the readings of its box.
//! 3. `miss_compensation` decides by depth whether a predicted box still holds its mover.
//! 4. `box_corrector` widens boxes that cut a mover short.
//! 5. `static_mask` masks the movers' pixels, but for parts that have been still while others moved, as
//!    `past_views` show.
//! 6. `unlabelled` finds what moves and is never detected: new readings in space that was free for long.
//!
//! [`BoxTracker`] works alone too: without depth and poses it is a plain SORT tracker.

mod block_depths;
mod box_corrector;
mod dynamics_config;
mod error;
mod foreground;
mod miss_compensation;
mod mover;
mod mover_labels;
mod past_views;
mod preprocessor;
mod scene_knowledge;
mod static_mask;
mod timestamp;
mod tracking;
mod unlabelled;

use box_corrector::BoxCorrector;
use foreground::{Foreground, ForegroundFinder, ForegroundSearch};
use past_views::PastViews;
use static_mask::{ComparedFrame, MaskRegion, StaticMaskBuilder, mask_body};
use unlabelled::UnlabelledFinder;

pub use dynamics_config::DynamicsConfig;
pub use error::Error;
pub use mover::Mover;
pub use preprocessor::{Preprocessed, Preprocessor};
pub use scene_knowledge::SceneKnowledge;
pub use static_mask::{MaskConfig, MaskMode};
pub use timestamp::check_timestamp;
pub use tracking::{BoxKalman, BoxSource, BoxTracker, TrackState, TrackedBox, TrackerConfig, View};
pub use unlabelled::FreeSpace;

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
