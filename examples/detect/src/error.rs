use std::io;
use std::path::PathBuf;

use dymlm::core::ConfigError;

/// Why a network cannot be used, or fails on an image.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum Error {
    /// The file cannot be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The network's file.
        path: PathBuf,
        /// The operating system's error.
        source: io::Error,
    },
    /// The file is not an ONNX network, or has operations that tract does not support.
    #[error("{}: not a network that tract can run: {reason}", path.display())]
    Unreadable {
        /// The network's file.
        path: PathBuf,
        /// tract's error.
        reason: String,
    },
    /// A network whose input or output is not YOLOX's.
    #[error("{}: not a YOLOX network: {reason}", path.display())]
    NotYolox {
        /// The network's file.
        path: PathBuf,
        /// What differs.
        reason: String,
    },
    /// The number of names is not the number of classes.
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
    /// The network failed while it ran.
    #[error("the network failed while it ran: {reason}")]
    Run {
        /// tract's error.
        reason: String,
    },
    /// A row of the network's output is not a detection: the score is not a probability, or the box is not
    /// finite.
    #[error("row {row} of the network's output is not a detection: score {score}, box {sides:?}")]
    Output {
        /// The row, from 0.
        row: usize,
        /// Its best score.
        score: f32,
        /// Left, upper, right and lower side in the network's pixels.
        sides: [f32; 4],
    },
    /// An image that cannot be scaled into the network's input: one of its sides would have no pixel.
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
