use serde::{Deserialize, Deserializer};

/// Reads a number of a config that may be infinite, for serde's `deserialize_with`: JSON has no infinity, and
/// `serde_json` writes null for it.
///
/// # Errors
///
/// Those of the deserializer, for what is neither a number nor null.
///
/// ```
/// #[derive(serde::Deserialize)]
/// struct Config {
///     #[serde(deserialize_with = "dymlm_core::null_is_infinite")]
///     max_range: f64,
/// }
///
/// let config: Config = serde_json::from_str(r#"{"max_range": null}"#)?;
/// assert_eq!(config.max_range, f64::INFINITY);
/// # Ok::<(), serde_json::Error>(())
/// ```
pub fn null_is_infinite<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
    let number: Option<f64> = Deserialize::deserialize(deserializer)?;
    Ok(number.unwrap_or(f64::INFINITY))
}
