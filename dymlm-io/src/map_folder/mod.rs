//! Map folders: files beside a manifest that lists them and has their sizes and checksums.

mod lock;
mod manifest;
mod reader;
mod replace;
mod state;
mod writer;

pub use reader::MapFolder;
pub use state::{DamagedPart, MapFolderSaver, StateParts, StateWriter};
pub use writer::MapFolderWriter;
