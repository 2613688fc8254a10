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
        /// The system's error.
        source: std::io::Error,
    },
    /// An observation cannot be read from the file.
    #[error("observation {index} cannot be read: {source}")]
    Read {
        /// Its number.
        index: usize,
        /// The system's error.
        source: std::io::Error,
    },
    /// The bytes of an observation are damaged.
    #[error("observation {index} is damaged")]
    Damaged {
        /// Its number.
        index: usize,
    },
    /// Nothing is kept under this number.
    #[error("observation {index} is not kept")]
    Unknown {
        /// The number.
        index: usize,
    },
    /// A saved history is damaged.
    #[cfg(feature = "state")]
    #[error(transparent)]
    State(#[from] dymlm_core::DamagedState),
}
