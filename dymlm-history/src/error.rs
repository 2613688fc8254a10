use std::path::PathBuf;

/// Why observations could not be kept or read. Nothing has changed.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file of the history cannot be made.
    #[error("no file for key-frame observations can be made in {folder}: {source}")]
    Create {
        /// Where it should be.
        folder: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// An observation cannot be read from the file.
    #[error("observation {index} cannot be read: {source}")]
    Read {
        /// Which one.
        index: usize,
        /// What the system says.
        source: std::io::Error,
    },
    /// An observation is not what was written.
    #[error("observation {index} is damaged")]
    Damaged {
        /// Which one.
        index: usize,
    },
    /// No such observation is kept under this number.
    #[error("observation {index} is not kept")]
    Unknown {
        /// Which one.
        index: usize,
    },
    /// A saved history is not what was written.
    #[cfg(feature = "state")]
    #[error(transparent)]
    State(#[from] dymlm_core::DamagedState),
}
