//! Map folders: files beside a manifest that says what they are and proves that they are whole.

mod lock;
mod manifest;
mod reader;
mod replace;
mod state;
mod writer;

pub use reader::MapFolder;
pub use state::{DamagedPart, MapFolderSaver, StateParts, StateWriter};
pub use writer::MapFolderWriter;
