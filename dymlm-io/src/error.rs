use std::io;
use std::path::{Path, PathBuf};

use dymlm_core::ConfigError;

use crate::UncoveredTime;

/// Why a file could not be read or written. Every message names the file, and the line where one is known.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file or folder.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// A line of a text file that cannot be used.
    #[error("{}, line {line}: {reason}", path.display())]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, counted from 1.
        line: usize,
        /// What is wrong with it.
        reason: String,
    },
    /// A file whose content is not what it should be.
    #[error("{}: {reason}", path.display())]
    Malformed {
        /// The file.
        path: PathBuf,
        /// What is wrong with it.
        reason: String,
    },
    /// An image of another size than the camera.
    #[error("{}: the image has {actual_width}x{actual_height} pixels, the camera {width}x{height}", path.display())]
    ImageSize {
        /// The image file.
        path: PathBuf,
        /// The camera's width, pixels.
        width: usize,
        /// The camera's height, pixels.
        height: usize,
        /// The image's width, pixels.
        actual_width: usize,
        /// The image's height, pixels.
        actual_height: usize,
    },
    /// A file named in a list cannot be used: says where the list names it, and what is wrong with it.
    #[error("{}, line {line}: {fault}", list.display())]
    Listed {
        /// The list.
        list: PathBuf,
        /// The line of the list, counted from 1.
        line: usize,
        /// What is wrong with the file.
        fault: Box<Error>,
    },
    /// A trajectory does not cover the time of a frame.
    #[error("{}, line {line}: {fault}", path.display())]
    Uncovered {
        /// The trajectory.
        path: PathBuf,
        /// The line of the last pose before the frame, or of the first pose when the frame is earlier.
        line: usize,
        /// The time of the frame, and the times that the trajectory covers.
        fault: UncoveredTime,
    },
    /// The transforms of a bag give no pose for a frame.
    #[cfg(feature = "mcap")]
    #[error("{}: {fault}", path.display())]
    NoTransform {
        /// The bag.
        path: PathBuf,
        /// What is missing.
        fault: crate::NoTransform,
    },
    /// The dataset has no frame of this index.
    #[error("no frame {index} in a dataset of {count} frames")]
    NoFrame {
        /// The frame asked for.
        index: usize,
        /// Number of frames.
        count: usize,
    },
    /// A buffer whose length is not width times height.
    #[error("{}: a buffer of {actual} pixels for an image of {width}x{height}", path.display())]
    BufferLength {
        /// The image file to be written.
        path: PathBuf,
        /// Width, pixels.
        width: usize,
        /// Height, pixels.
        height: usize,
        /// Given length.
        actual: usize,
    },
    /// A map folder has a format that this version does not read.
    #[error("{}: a map folder of format version {found}; this version reads {supported}", path.display())]
    MapVersion {
        /// The manifest.
        path: PathBuf,
        /// The folder's format version.
        found: u32,
        /// The format version read here.
        supported: u32,
    },
    /// A file of a map folder has changed since it was written.
    #[error(
        "{}: {actual_bytes} bytes with CRC-32 {actual_crc32:08x}, but the manifest says {bytes} with {crc32:08x}",
        path.display()
    )]
    Checksum {
        /// The file.
        path: PathBuf,
        /// Size in the manifest, bytes.
        bytes: u64,
        /// Checksum in the manifest.
        crc32: u32,
        /// Size found, bytes.
        actual_bytes: u64,
        /// Checksum found; 0 when the sizes differ, since it is not computed then.
        actual_crc32: u32,
    },
    /// Another process, or another part of this one, is writing the map in this folder.
    #[error("{}: somebody else writes this map: end that program first, or choose another folder", path.display())]
    Locked {
        /// The folder.
        path: PathBuf,
    },
    /// One part of a saved state cannot be read.
    #[error(transparent)]
    DamagedPart(#[from] crate::DamagedPart),
    /// Something that is not a map is in the place of a map or of its file: nothing is changed.
    #[error("{}: is in the way of the map and does not belong to a map; nothing was changed", path.display())]
    InTheWay {
        /// The folder or file.
        path: PathBuf,
    },
    /// The code that produces a file's content failed; the file was not written.
    #[error("{}: {source}", path.display())]
    Content {
        /// The file.
        path: PathBuf,
        /// The error that the code returned.
        source: Box<dyn std::error::Error + Send + Sync>,
    },
    /// The file's format cannot hold something that was to be written.
    #[cfg(any(feature = "mcap", feature = "gltf"))]
    #[error("{}: cannot hold {reason}", path.display())]
    Unwritable {
        /// The file.
        path: PathBuf,
        /// What cannot be held, and why.
        reason: String,
    },
    /// An option outside its allowed range.
    #[error(transparent)]
    Config(#[from] ConfigError),
}

impl Error {
    /// An error of the operating system on this file.
    pub(crate) fn io(path: &Path) -> impl FnOnce(io::Error) -> Self {
        move |source| Self::Io { path: path.to_path_buf(), source }
    }

    /// Whether a file or folder is not there.
    pub(crate) fn is_not_found(&self) -> bool {
        matches!(self, Self::Io { source, .. } if source.kind() == io::ErrorKind::NotFound)
    }

    pub(crate) fn line(path: &Path, line: usize, reason: impl Into<String>) -> Self {
        Self::Line { path: path.to_path_buf(), line, reason: reason.into() }
    }

    pub(crate) fn malformed(path: &Path, reason: impl Into<String>) -> Self {
        Self::Malformed { path: path.to_path_buf(), reason: reason.into() }
    }
}
