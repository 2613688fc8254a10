use dymlm_history::HistoryConfig;

use crate::MemoryConfig;
use crate::files::ConfigFileError;

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
#[derive(Debug, Clone, PartialEq, Eq, Default, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct LoadOptions {
    /// Where the observations of key frames are kept from now on; `None` for where they were. Maps that have
    /// been made without a history have none.
    pub history: Option<HistoryConfig>,
    /// How much memory the maps may take from now on, and where the file for the rest of them is; `None` for
    /// what their config says.
    pub memory: Option<MemoryConfig>,
}

impl LoadOptions {
    /// Reads `[history]` and `[memory]` as a config file has them; nothing differs for what is left out.
    ///
    /// # Errors
    ///
    /// [`ConfigFileError`] names the field and the line, also those of other settings: the maps keep those
    /// that they have been made with.
    ///
    /// ```
    /// use dymlm::files::LoadOptions;
    ///
    /// let here = LoadOptions::from_toml("[memory]\nbudget = 500_000_000")?;
    /// assert_eq!(here.memory.and_then(|memory| memory.budget), Some(500_000_000));
    /// assert_eq!(here.history, None);
    /// assert!(LoadOptions::from_toml("[cloud]\nvoxel_size = 0.01").is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_toml(text: &str) -> Result<Self, ConfigFileError> {
        Ok(toml::from_str(text)?)
    }
}
