use dymlm_core::ConfigError;

use crate::{AssociationConfig, ParameterizationConfig, ShapeTable, SizePrior, SizePriors, UpdateConfig};

/// Settings of an [`ObjectMapper`](crate::ObjectMapper), one part for each step. Validated once, in
/// [`ObjectMapper::new`](crate::ObjectMapper::new).
///
/// ```
/// use dymlm_core::SensorModel;
/// use dymlm_objects::{ObjectConfig, ObjectMapper};
///
/// let mut config = ObjectConfig::default();
/// config.update.voxel_size = 0.02;
/// assert!(ObjectMapper::new(config.clone(), SensorModel::kinect()).is_ok());
///
/// config.update.voxel_size = -1.0;
/// let error = ObjectMapper::new(config, SensorModel::kinect()).unwrap_err();
/// assert_eq!(error.to_string(), "objects.update.voxel_size = -1 is outside its range 0.001..=0.1");
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct ObjectConfig {
    /// From detections to boxes in space.
    pub parameterization: ParameterizationConfig,
    /// Association of detections with objects.
    pub association: AssociationConfig,
    /// Update of objects: points, outliers, new parameters, confirmation.
    pub update: UpdateConfig,
    /// Plausible sizes of things, by label.
    pub sizes: SizePriors,
    /// Which labels are boxes; all others are ellipsoids.
    pub shapes: ShapeTable,
}

impl ObjectConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        self.parameterization.validate()?;
        self.association.validate()?;
        self.update.validate()?;
        self.sizes.iter().try_for_each(SizePrior::validate)
    }
}
