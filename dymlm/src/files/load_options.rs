use dymlm_history::HistoryConfig;

use crate::MemoryConfig;

/// How to load maps where something differs from where they were saved: the maps of a robot on a server, for
/// example. By default nothing differs.
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
    /// How much memory the maps may take from now on, and where the file for the rest of them is; `None` for
    /// what their config says.
    pub memory: Option<MemoryConfig>,
}
