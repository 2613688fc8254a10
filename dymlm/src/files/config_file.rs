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
        let mut file: Table = toml::from_str(text)?;
        let preset = match file.remove("preset") {
            // Parsed from the text, so that errors name the file's lines.
            None => return Ok(toml::from_str(text)?),
            Some(Value::String(name)) => match name.as_str() {
                "default" => Self::default(),
                "offline" => Self::offline(),
                "robot" => Self::robot(),
                _ => return Err(ConfigFileError::Preset(name)),
            },
            Some(other) => return Err(ConfigFileError::Preset(other.to_string())),
        };
        let mut table = Table::try_from(preset)?;
        // A sensor's preset replaces the whole sensor, not only the fields that the file leaves out.
        if file.get("sensor").is_some_and(|sensor| sensor.get("preset").is_some()) {
            table.remove("sensor");
        }
        overlay(&mut table, file);
        Ok(table.try_into()?)
    }
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
