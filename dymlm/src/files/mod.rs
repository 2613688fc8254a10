//! The maps as files (feature `io`): the standard files of a map folder and their records, the state from
//! which a map goes on, and config files.

mod autosave;
mod config_file;
mod map_files;
mod map_saver;
mod map_state;
mod objects;
mod planes;

pub use autosave::Autosave;
pub use config_file::ConfigFileError;
pub use map_saver::MapSaver;
pub use map_state::MissingMap;
pub use objects::object_records;
pub use planes::{id_color, plane_cloud, plane_records};
