//! The maps as files (feature `io`): the standard files of a map folder and their records, the state from
//! which a map goes on, config files, and what viewers open.

mod autosave;
mod config_file;
#[cfg(feature = "gltf")]
mod glb;
mod load_options;
mod map_files;
mod map_saver;
mod map_state;
mod objects;
#[cfg(feature = "mcap")]
mod outline_tiles;
mod planes;
mod saved_state;
#[cfg(feature = "mcap")]
mod session_recorder;
#[cfg(feature = "mcap")]
mod topic_tiles;

pub use autosave::Autosave;
pub use config_file::ConfigFileError;
pub use dymlm_io::id_color;
pub use load_options::LoadOptions;
pub use map_saver::MapSaver;
pub use map_state::MissingMap;
pub use objects::object_records;
pub use planes::{plane_cloud, plane_records};
#[cfg(feature = "mcap")]
pub use session_recorder::SessionRecorder;
