use serde::Serialize;
use serde::de::DeserializeOwned;

/// Takes what has changed of a state that is being saved: a part's key and its bytes, `None` where the part
/// no longer exists.
///
/// A map's state comes in parts, so that parts that have not changed since the last save are not written
/// again.
pub type StateSink<'a> = dyn FnMut(u64, Option<&[u8]>) -> std::io::Result<()> + 'a;

/// A part of a saved state is not what the program can have written: it was damaged, or made by hand.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("part {part:#x} of the saved state is damaged: {what}")]
pub struct DamagedState {
    /// The part's key.
    pub part: u64,
    /// What is wrong with it.
    pub what: String,
}

impl DamagedState {
    /// The error for a part, with what is wrong with it.
    pub fn new(part: u64, what: impl Into<String>) -> Self {
        Self { part, what: what.into() }
    }
}

/// A value as bytes: small integers take few bytes, floating-point numbers are kept bit by bit.
///
/// # Errors
///
/// A value that serde's traits cannot describe, such as a sequence of unknown length.
pub fn encode_part<T: Serialize + ?Sized>(value: &T) -> std::io::Result<Vec<u8>> {
    postcard::to_stdvec(value).map_err(std::io::Error::other)
}

/// The value from which [`encode_part`] made these bytes.
///
/// # Errors
///
/// [`DamagedState`] when the bytes are not those of such a value, also when bytes are left over.
pub fn decode_part<T: DeserializeOwned>(part: u64, bytes: &[u8]) -> Result<T, DamagedState> {
    match postcard::take_from_bytes(bytes) {
        Ok((value, [])) => Ok(value),
        Ok((_, left)) => Err(DamagedState::new(part, format!("{} bytes too many", left.len()))),
        Err(error) => Err(DamagedState::new(part, error.to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Pose;

    #[test]
    fn floating_point_numbers_come_back_to_the_bit() {
        let values = [0.1, -0.0, f64::NAN, f64::INFINITY, 5e-324, f64::from_bits(0x7ff0_0000_0000_0001)];
        let bytes = encode_part(&values).unwrap();
        let back: [f64; 6] = decode_part(0, &bytes).unwrap();
        assert_eq!(back.map(f64::to_bits), values.map(f64::to_bits));
    }

    #[test]
    fn poses_come_back_to_the_bit() {
        let turn = Pose::new([0.1, 0.2, 0.3], [0.1, 0.2, 0.3, 0.9273]).unwrap();
        let mut pose = turn;
        for _ in 0..1000 {
            pose = pose * turn;
            let back: Pose = decode_part(0, &encode_part(&pose).unwrap()).unwrap();
            assert_eq!(back.quaternion().map(f64::to_bits), pose.quaternion().map(f64::to_bits));
            assert_eq!(back, pose);
        }
    }

    #[test]
    fn bytes_that_are_cut_or_too_many_are_damaged() {
        let bytes = encode_part(&vec![1_u64, 300, u64::MAX]).unwrap();
        assert_eq!(decode_part::<Vec<u64>>(7, &bytes).unwrap(), [1, 300, u64::MAX]);
        for length in 0..bytes.len() {
            assert_eq!(decode_part::<Vec<u64>>(7, &bytes[..length]).unwrap_err().part, 7);
        }
        let longer = [bytes, vec![0]].concat();
        assert!(decode_part::<Vec<u64>>(7, &longer).unwrap_err().to_string().contains("too many"));
    }

    #[test]
    fn a_length_beyond_the_bytes_allocates_nothing_of_that_size() {
        let huge = [0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0x7f];
        assert!(decode_part::<Vec<[u64; 16]>>(0, &huge).is_err());
    }
}
