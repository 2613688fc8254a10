use crate::Error;

/// Largest timestamp that can be in seconds; epoch times in milliseconds are above it.
const MAX_TIMESTAMP: f64 = 1e11;

/// Checks whether a timestamp can be in seconds.
///
/// # Errors
///
/// [`Error::Timestamp`] when it is not finite, or above 1e11 in magnitude.
pub fn check_timestamp(timestamp: f64) -> Result<(), Error> {
    // The range does not contain NaN.
    let is_in_range = (-MAX_TIMESTAMP..=MAX_TIMESTAMP).contains(&timestamp);
    if is_in_range { Ok(()) } else { Err(Error::Timestamp(timestamp)) }
}
