use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use crate::MapConfig;

/// Why a config file was refused.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ConfigFileError {
    /// Not TOML, an unknown field, or a value of another type.
    #[error(transparent)]
    Toml(#[from] toml::de::Error),
    /// There is no preset of this name.
    #[error("preset = {0}: there are \"default\", \"offline\" and \"robot\"")]
    Preset(String),
    /// The preset cannot be written as TOML.
    #[error(transparent)]
    Unwritable(#[from] toml::ser::Error),
}

impl MapConfig {
    /// Reads a config file, which names what differs from a preset: at its top `preset = "default"`,
    /// `"offline"` or `"robot"`, in `[sensor]` `preset = "kinect"`, `"realsense_d4xx"` or `"time_of_flight"`.
    /// What the file leaves out is as in the preset. Ranges are checked by
    /// [`MapBuilder::new`](crate::MapBuilder::new).
    ///
    /// # Errors
    ///
    /// [`ConfigFileError`] names the field and the line.
    ///
    /// ```
    /// use dymlm::MapConfig;
    /// use dymlm::core::SensorModel;
    ///
    /// let config = MapConfig::from_toml(
    ///     r#"
    ///     preset = "robot"
    ///     [sensor]
    ///     preset = "realsense_d4xx"
    ///     max_depth = 5.0
    ///     [cloud]
    ///     voxel_size = 0.03
    ///     "#,
    /// )?;
    /// assert_eq!(config.cloud.voxel_size, 0.03);
    /// assert_eq!(config.key_frames, MapConfig::robot().key_frames);
    /// assert_eq!(config.sensor, SensorModel { max_depth: 5.0, ..SensorModel::realsense_d4xx() });
    /// assert!(MapConfig::from_toml("[cloud]\nvoxel_sise = 0.03").is_err());
    /// # Ok::<(), Box<dyn std::error::Error>>(())
    /// ```
    pub fn from_toml(text: &str) -> Result<Self, ConfigFileError> {
        let (preset, settings) = without_preset(text)?;
        // By itself first, so that errors name the file's lines.
        let config: Self = toml::from_str(&settings)?;
        let preset = match preset.as_deref() {
            None => return Ok(config),
            Some("default") => Self::default(),
            Some("offline") => Self::offline(),
            Some("robot") => Self::robot(),
            Some(other) => return Err(ConfigFileError::Preset(other.to_owned())),
        };
        let file: Table = toml::from_str(&settings)?;
        let mut table: Table = toml::from_str(&toml::to_string(&preset)?)?;
        // A sensor's preset replaces the whole sensor, not only the fields that the file leaves out.
        if file.get("sensor").is_some_and(|sensor| sensor.get("preset").is_some()) {
            table.remove("sensor");
        }
        overlay(&mut table, file);
        Ok(toml::from_str(&toml::to_string(&table)?)?)
    }
}

/// The preset that a file names at its top, and the file with spaces in its place: all else keeps its line.
fn without_preset(text: &str) -> Result<(Option<String>, String), ConfigFileError> {
    let file = DeTable::parse(text)?;
    let Some((key, value)) = file.get_ref().get_key_value("preset") else {
        return Ok((None, text.to_owned()));
    };
    let DeValue::String(preset) = value.get_ref() else {
        return Err(ConfigFileError::Preset(text.get(value.span()).unwrap_or_default().to_owned()));
    };
    let place = key.span().start..value.span().end;
    let mut rest = text.to_owned();
    rest.replace_range(place.clone(), &" ".repeat(place.len()));
    Ok((Some(preset.to_string()), rest))
}

/// Puts the values of `over` into `base`, table by table.
fn overlay(base: &mut Table, over: Table) {
    for (key, value) in over {
        match (base.get_mut(&key), value) {
            (Some(Value::Table(base)), Value::Table(over)) => overlay(base, over),
            (_, value) => {
                base.insert(key, value);
            }
        }
    }
}
