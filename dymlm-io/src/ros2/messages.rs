//! The ROS 2 messages that are read, or read and written. Fields are in the order of the message definitions.
//! Of an odometry only the beginning is read, and the rest is ignored.

use byteorder::{BigEndian, LittleEndian};
use serde::{Deserialize, Serialize, Serializer};

/// Four bytes before each message: CDR, little-endian.
const ENCAPSULATION: [u8; 4] = [0, 1, 0, 0];

/// Decodes a message: four bytes that name its encoding, then CDR.
pub(crate) fn decode<'a, T: Deserialize<'a>>(message: &'a [u8]) -> Result<T, String> {
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

/// Encodes a message as [`decode`] reads it, replacing the content of `out`.
pub(crate) fn encode(message: &impl Serialize, out: &mut Vec<u8>) -> Result<(), String> {
    out.clear();
    out.extend_from_slice(&ENCAPSULATION);
    cdr_encoding::to_writer::<_, LittleEndian, _>(out, message).map_err(|error| error.to_string())
}

/// Serializes bytes at once, which is much faster than one by one.
pub(crate) fn as_bytes<S: Serializer>(bytes: &[u8], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_bytes(bytes)
}

#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
pub(crate) struct Time {
    pub(crate) sec: i32,
    pub(crate) nanosec: u32,
}

impl Time {
    /// The time stamp of a time in seconds, rounded to nanoseconds; `None` when a time stamp cannot hold it.
    pub(crate) fn of(seconds: f64) -> Option<Self> {
        // The fraction of a second is exact; all seconds times 1e9 would not be.
        let nanoseconds = ((seconds - seconds.floor()) * 1e9).round() as u32;
        let (carry, nanosec) = (nanoseconds / 1_000_000_000, nanoseconds % 1_000_000_000);
        let whole = seconds.floor() + f64::from(carry);
        (0.0..=f64::from(i32::MAX)).contains(&whole).then_some(Self { sec: whole as i32, nanosec })
    }

    /// Nanoseconds since time 0.
    pub(crate) fn nanoseconds(self) -> u64 {
        u64::from(self.sec.unsigned_abs()) * 1_000_000_000 + u64::from(self.nanosec)
    }

    /// Seconds; `None` for 0, which means that the stamp was never set.
    pub(crate) fn seconds(self) -> Option<f64> {
        (self.sec != 0 || self.nanosec != 0).then(|| f64::from(self.sec) + f64::from(self.nanosec) / 1e9)
    }
}

#[derive(Debug, Clone, Deserialize, Serialize)]
pub(crate) struct Header {
    pub(crate) stamp: Time,
    pub(crate) frame_id: String,
}

#[derive(Debug, Deserialize)]
pub(crate) struct HeaderOnly {
    pub(crate) header: Header,
}

#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct Image<'a> {
    pub(crate) header: Header,
    pub(crate) height: u32,
    pub(crate) width: u32,
    pub(crate) encoding: String,
    pub(crate) is_bigendian: u8,
    pub(crate) step: u32,
    #[serde(serialize_with = "as_bytes")]
    pub(crate) data: &'a [u8],
}

#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct CompressedImage<'a> {
    pub(crate) header: Header,
    pub(crate) format: String,
    #[serde(serialize_with = "as_bytes")]
    pub(crate) data: &'a [u8],
}

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub(crate) struct Lens {
    pub(crate) height: u32,
    pub(crate) width: u32,
    pub(crate) distortion_model: String,
    pub(crate) d: Vec<f64>,
    pub(crate) k: [f64; 9],
    pub(crate) r: [f64; 9],
    pub(crate) p: [f64; 12],
    pub(crate) binning_x: u32,
    pub(crate) binning_y: u32,
    pub(crate) roi: RegionOfInterest,
}

#[derive(Debug, Clone, PartialEq, Deserialize, Serialize)]
pub(crate) struct RegionOfInterest {
    pub(crate) x_offset: u32,
    pub(crate) y_offset: u32,
    pub(crate) height: u32,
    pub(crate) width: u32,
    pub(crate) do_rectify: bool,
}

#[derive(Debug, Clone, Deserialize, Serialize)]
pub(crate) struct CameraInfo {
    pub(crate) header: Header,
    pub(crate) lens: Lens,
}

#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
pub(crate) struct Vector3 {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) z: f64,
}

#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
pub(crate) struct Rotation {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) z: f64,
    pub(crate) w: f64,
}

/// A transform or a pose: both have the same kinds of fields.
#[derive(Debug, Clone, Copy, Deserialize, Serialize)]
pub(crate) struct Transform {
    pub(crate) translation: Vector3,
    pub(crate) rotation: Rotation,
}

#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct TransformStamped {
    pub(crate) header: Header,
    pub(crate) child_frame_id: String,
    pub(crate) transform: Transform,
}

#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct TransformMessage {
    pub(crate) transforms: Vec<TransformStamped>,
}

/// An odometry without its covariances and twist: what is left has the fields of a stamped transform.
pub(crate) type Odometry = TransformStamped;

#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct Hypothesis {
    pub(crate) class_id: String,
    pub(crate) score: f64,
    pub(crate) pose: Transform,
    /// 36 numbers in two halves: serde has no arrays longer than 32.
    pub(crate) covariance: ([f64; 18], [f64; 18]),
}

#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct Box2D {
    pub(crate) x: f64,
    pub(crate) y: f64,
    pub(crate) theta: f64,
    pub(crate) size_x: f64,
    pub(crate) size_y: f64,
}

#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct Detection2D {
    pub(crate) header: Header,
    pub(crate) results: Vec<Hypothesis>,
    pub(crate) bbox: Box2D,
    pub(crate) id: String,
}

#[derive(Debug, Deserialize, Serialize)]
pub(crate) struct Detection2DArray {
    pub(crate) header: Header,
    pub(crate) detections: Vec<Detection2D>,
}
