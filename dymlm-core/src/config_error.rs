use std::ops::RangeInclusive;

/// A field of a config outside its allowed range.
///
/// Every config of the `dymlm` crates is validated once, when the thing it configures is made; the first
/// field at fault is named.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field} = {value} is outside its range {min}..={max}")]
pub struct ConfigError {
    /// Path of the field, for example `cloud.voxel_size`.
    pub field: &'static str,
    /// The value it has.
    pub value: f64,
    /// Smallest allowed value.
    pub min: f64,
    /// Largest allowed value.
    pub max: f64,
}

/// Checks that a config field lies in its documented range.
///
/// # Errors
///
/// [`ConfigError`] when `value` is NaN or outside `range`.
///
/// ```
/// use dymlm_core::check_range;
///
/// assert!(check_range("voxel_size", 0.01, 1e-4..=10.0).is_ok());
/// let error = check_range("voxel_size", -1.0, 1e-4..=10.0).unwrap_err();
/// assert_eq!(error.to_string(), "voxel_size = -1 is outside its range 0.0001..=10");
/// ```
pub fn check_range(field: &'static str, value: f64, range: RangeInclusive<f64>) -> Result<(), ConfigError> {
    if range.contains(&value) {
        Ok(())
    } else {
        Err(ConfigError { field, value, min: *range.start(), max: *range.end() })
    }
}
