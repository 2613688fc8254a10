//! The part of a box's pixels that is the mover.

#[expect(clippy::module_inception, reason = "the type of this name")]
mod foreground;
mod foreground_config;
mod foreground_finder;

pub use foreground::Foreground;
pub use foreground_config::ForegroundConfig;
pub use foreground_finder::{ForegroundFinder, ForegroundSearch};
