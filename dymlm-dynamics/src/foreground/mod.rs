//! The part of a box's pixels that is the mover.

mod background;
mod choice;
mod cluster_motion;
#[expect(clippy::module_inception, reason = "the type of this name")]
mod foreground;
mod foreground_finder;

pub(crate) use foreground::Foreground;
pub(crate) use foreground_finder::{ForegroundFinder, ForegroundSearch};
