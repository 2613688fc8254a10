use dymlm_core::{ConfigError, check_range};
use serde::{Deserialize, Serialize};

/// How a session is written.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
#[non_exhaustive]
pub struct McapWriterOptions {
    /// Default: [`DepthEncoding::Millimetres`].
    pub depth: DepthEncoding,
    /// Default: [`ColorEncoding::Jpeg`].
    pub color: ColorEncoding,
    /// Quality of JPEG, 1..=100. Default 90.
    pub jpeg_quality: u8,
}

/// How depth images are written. [`McapRecording`](crate::McapRecording) reads all of these encodings.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum DepthEncoding {
    /// No depth images are written.
    None,
    /// Whole millimetres up to 65 m, `sensor_msgs/Image` 16UC1, which all viewers draw.
    Millimetres,
    /// Whole millimetres as PNG, `sensor_msgs/CompressedImage` as `compressed_depth_image_transport` makes
    /// it: smaller, but slower to write, and some viewers do not draw it.
    MillimetresPng,
    /// Exact metres, `sensor_msgs/Image` 32FC1: a map that is built from the file is identical.
    Exact,
}

/// How colour images are written, as `sensor_msgs/CompressedImage`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum ColorEncoding {
    /// No colour images are written.
    None,
    /// JPEG of [`McapWriterOptions::jpeg_quality`].
    Jpeg,
    /// PNG, lossless.
    Png,
}

impl Default for McapWriterOptions {
    fn default() -> Self {
        Self { depth: DepthEncoding::Millimetres, color: ColorEncoding::Jpeg, jpeg_quality: 90 }
    }
}

impl McapWriterOptions {
    /// Depth and colour without any loss: a map built from the file equals the map built from the frames,
    /// provided that their times are whole nanoseconds and their quaternions have length 1 to the last bit.
    pub fn exact() -> Self {
        Self { depth: DepthEncoding::Exact, color: ColorEncoding::Png, ..Self::default() }
    }

    pub(super) fn validate(&self) -> Result<(), ConfigError> {
        check_range("mcap_writer.jpeg_quality", f64::from(self.jpeg_quality), 1.0..=100.0)
    }
}
