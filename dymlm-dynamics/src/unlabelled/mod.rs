//! Movers that no detector reports: new readings in space that was free for long.

mod free_space;
mod new_surface;
mod unlabelled_finder;

pub use free_space::FreeSpace;
pub(crate) use unlabelled_finder::{Cutting, UnlabelledFinder};
