//! Questions that more than one map answers.

mod floor_grid;
mod floor_under;
mod objects_on;

pub use floor_grid::{FloorGrid, FloorGridConfig};
pub use floor_under::FloorUnder;
