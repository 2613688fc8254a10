use std::io;
use std::path::PathBuf;

use dymlm::core::ConfigError;

/// Why a network cannot be used, or does not work on an image.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The operating system refused.
    #[error("{}: {source}", path.display())]
    Io {
        /// The network's file.
        path: PathBuf,
        /// What the operating system said.
        source: io::Error,
    },
    /// The file holds no ONNX network, or one with operations that tract does not have.
    #[error("{}: no network that tract can run: {reason}", path.display())]
    Unreadable {
        /// The network's file.
        path: PathBuf,
        /// What tract said.
        reason: String,
    },
    /// A network of another kind: its input or its output is not YOLOX's.
    #[error("{}: not a YOLOX network: {reason}", path.display())]
    NotYolox {
        /// The network's file.
        path: PathBuf,
        /// What differs.
        reason: String,
    },
    /// Names for another number of classes.
    #[error("{}: {names} class names for a network of {classes} classes", path.display())]
    ClassNames {
        /// The network's file.
        path: PathBuf,
        /// Number of names given.
        names: usize,
        /// Number of classes in the network's output.
        classes: usize,
    },
    /// An option outside its allowed range.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The network broke off.
    #[error("the network broke off: {reason}")]
    Run {
        /// What tract said.
        reason: String,
    },
    /// The network's output is no detection: a score that is no probability, or a box without place.
    #[error("row {row} of the network's output is no detection: score {score}, box {sides:?}")]
    Output {
        /// The row, from 0.
        row: usize,
        /// Its best score.
        score: f32,
        /// Left, upper, right and lower side in the network's pixels.
        sides: [f32; 4],
    },
    /// An image that cannot be scaled into the network's square: a side of it would have no pixel.
    #[error("an image of {width}x{height} pixels cannot be scaled into {network_width}x{network_height}")]
    ImageSize {
        /// The image's width, pixels.
        width: usize,
        /// The image's height, pixels.
        height: usize,
        /// The network's width, pixels.
        network_width: usize,
        /// The network's height, pixels.
        network_height: usize,
    },
}
