//! Map folders: files beside a manifest that says what they are and proves that they are whole.

mod manifest;
mod reader;
mod replace;
mod writer;

pub use reader::MapFolder;
pub use writer::MapFolderWriter;
