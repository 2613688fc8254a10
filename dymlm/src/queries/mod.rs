//! Questions that more than one map answers.

mod floor_under;

pub use floor_under::FloorUnder;
