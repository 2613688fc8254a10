//! The ROS 2 messages that are read, field by field in their order. Of some only the beginning is: what
//! follows is passed over.

use byteorder::{BigEndian, LittleEndian};
use serde::Deserialize;

/// Reads a message: 4 bytes that say how it is encoded, then CDR.
pub(super) fn decode<'a, T: Deserialize<'a>>(message: &'a [u8]) -> Result<T, String> {
    let Some((&[_, kind, _, _], body)) = message.split_first_chunk::<4>() else {
        return Err(format!("a message of {} bytes", message.len()));
    };
    let decoded = match kind {
        0 => cdr_encoding::from_bytes::<T, BigEndian>(body),
        1 => cdr_encoding::from_bytes::<T, LittleEndian>(body),
        other => return Err(format!("an encapsulation {other:#04x}; plain CDR (0 and 1) is read")),
    };
    decoded.map(|(value, _)| value).map_err(|error| error.to_string())
}

#[derive(Debug, Clone, Copy, Deserialize)]
pub(super) struct Time {
    pub(super) sec: i32,
    pub(super) nanosec: u32,
}

impl Time {
    /// Seconds; `None` for 0, which means that nobody has set it.
    pub(super) fn seconds(self) -> Option<f64> {
        (self.sec != 0 || self.nanosec != 0).then(|| f64::from(self.sec) + f64::from(self.nanosec) / 1e9)
    }
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct Header {
    pub(super) stamp: Time,
    pub(super) frame_id: String,
}

#[derive(Debug, Deserialize)]
pub(super) struct HeaderOnly {
    pub(super) header: Header,
}

#[derive(Debug, Deserialize)]
pub(super) struct Image<'a> {
    pub(super) header: Header,
    pub(super) height: u32,
    pub(super) width: u32,
    pub(super) encoding: String,
    pub(super) is_bigendian: u8,
    pub(super) step: u32,
    pub(super) data: &'a [u8],
}

#[derive(Debug, Deserialize)]
pub(super) struct CompressedImage<'a> {
    pub(super) header: Header,
    pub(super) format: String,
    pub(super) data: &'a [u8],
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(super) struct Lens {
    pub(super) height: u32,
    pub(super) width: u32,
    pub(super) distortion_model: String,
    pub(super) d: Vec<f64>,
    pub(super) k: [f64; 9],
    pub(super) r: [f64; 9],
    pub(super) p: [f64; 12],
    pub(super) binning_x: u32,
    pub(super) binning_y: u32,
    pub(super) roi: RegionOfInterest,
}

#[derive(Debug, Clone, PartialEq, Deserialize)]
pub(super) struct RegionOfInterest {
    pub(super) x_offset: u32,
    pub(super) y_offset: u32,
    pub(super) height: u32,
    pub(super) width: u32,
}

#[derive(Debug, Clone, Deserialize)]
pub(super) struct CameraInfo {
    pub(super) header: Header,
    pub(super) lens: Lens,
}

#[derive(Debug, Clone, Copy, Deserialize)]
pub(super) struct Vector3 {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
}

#[derive(Debug, Clone, Copy, Deserialize)]
pub(super) struct Rotation {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) z: f64,
    pub(super) w: f64,
}

/// A transform, and a pose: their fields are of one kind.
#[derive(Debug, Clone, Copy, Deserialize)]
pub(super) struct Transform {
    pub(super) translation: Vector3,
    pub(super) rotation: Rotation,
}

#[derive(Debug, Deserialize)]
pub(super) struct TransformStamped {
    pub(super) header: Header,
    pub(super) child_frame_id: String,
    pub(super) transform: Transform,
}

#[derive(Debug, Deserialize)]
pub(super) struct TransformMessage {
    pub(super) transforms: Vec<TransformStamped>,
}

/// An odometry without its covariances and twist. It has the fields of a transform.
pub(super) type Odometry = TransformStamped;

#[derive(Debug, Deserialize)]
pub(super) struct Hypothesis {
    pub(super) class_id: String,
    pub(super) score: f64,
    _pose: Transform,
    _covariance: ([f64; 18], [f64; 18]),
}

#[derive(Debug, Deserialize)]
pub(super) struct Box2D {
    pub(super) x: f64,
    pub(super) y: f64,
    pub(super) theta: f64,
    pub(super) size_x: f64,
    pub(super) size_y: f64,
}

#[derive(Debug, Deserialize)]
pub(super) struct Detection2D {
    _header: Header,
    pub(super) results: Vec<Hypothesis>,
    pub(super) bbox: Box2D,
    _id: String,
}

#[derive(Debug, Deserialize)]
pub(super) struct Detection2DArray {
    _header: Header,
    pub(super) detections: Vec<Detection2D>,
}
