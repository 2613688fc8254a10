//! Finds what moves in an RGB-D frame: box tracking, missed detections, box correction, static mask.
//!
//! This is the preprocessing of the multi-level map (paper section III-A). [`Preprocessor::process`] runs the
//! steps, each of which has a file or folder of its own:
//!
//! 1. `tracking` follows the detector's boxes from frame to frame and predicts the boxes that the detector
//!    misses.
//! 2. `foreground` finds the mover among the readings of its box.
//! 3. `miss_compensation` decides by depth whether a predicted box still holds its mover.
//! 4. `box_corrector` widens boxes that cut a mover short.
//! 5. `static_mask` masks the movers' pixels, except parts that `past_views` show to have been still while
//!    other parts moved.
//! 6. `unlabelled` finds movers that no detector reports: new readings in space that was free for long.
//!
//! [`BoxTracker`] also works alone: without depth and poses it is a SORT tracker with the additions named
//! there.

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
mod surroundings;
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
