//! The maps as files (feature `io`): the standard files of a map folder, their records, and config files.

mod config_file;
mod map_files;
mod objects;
mod planes;

pub use config_file::ConfigFileError;
pub use objects::object_records;
pub use planes::{id_color, plane_cloud, plane_records};
