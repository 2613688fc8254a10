//! What tests and benches of several crates share.
//!
//! - [`recording`] finds the real recordings.

mod recording;

pub use recording::recording;
