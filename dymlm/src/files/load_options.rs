use dymlm_history::HistoryConfig;

use crate::MemoryConfig;

/// What is another where maps are loaded than where they were saved: on a server, the maps of a robot.
/// By default nothing is.
///
/// ```
/// # use dymlm::files::LoadOptions;
/// use dymlm::{HistoryConfig, MemoryConfig};
///
/// let mut here = LoadOptions::default();
/// here.history = Some(HistoryConfig::None); // to look at the maps without the folder of their key frames
/// here.memory = Some(MemoryConfig::default()); // no budget, and no file
/// ```
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct LoadOptions {
    /// Where the observations of key frames are kept from now on; `None` for where they were. Maps that have
    /// been made without a history have none.
    pub history: Option<HistoryConfig>,
    /// How much memory the maps may take from now on, and where the file for the rest of them is; `None` for what
    /// their config says.
    pub memory: Option<MemoryConfig>,
}
