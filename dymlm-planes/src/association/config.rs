use dymlm_core::{ConfigError, check_range};

/// Whether the two sides of a sheet count as one plane.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum Sides {
    /// A plane is seen from the side its normal points to; the two faces of a partition are two planes.
    #[default]
    Apart,
    /// A plane seen from behind is the same plane, as in the paper's equation 1; normal and offset change
    /// sign together.
    Joined,
}

/// Settings of the test whether two finite planes are one: the paper's equations 1 and 2, and whether the
/// patches adjoin.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct AssociationConfig {
    /// The paper's `beta_Th`: the angle between the normals must be smaller, degrees, 0.1..=90. Default 10.
    pub max_angle_deg: f64,
    /// The paper's `d_Th`: the root mean square distance of the detected patch from the map plane must be
    /// smaller, metres, 0..=10. Default 0.05. Nearer planes stay two if a key frame shows the step between them.
    pub max_distance: f64,
    /// Largest gap between patches that adjoin, metres, 0..=10. Default 0.04: less than between two screens
    /// or two cabinets side by side.
    pub max_gap: f64,
    /// Largest gap over which two planes of the map also count as one, if something nearer occludes the gap,
    /// metres, 0..=10. Default 0.8: what a person occludes of a wall, or a table of the floor. 0 turns this
    /// off.
    pub max_occluded_gap: f64,
    /// Whether the two sides of a sheet count as one plane. Default: they do not.
    pub sides: Sides,
}

impl Default for AssociationConfig {
    fn default() -> Self {
        Self {
            max_angle_deg: 10.0,
            max_distance: 0.05,
            max_gap: 0.04,
            max_occluded_gap: 0.8,
            sides: Sides::Apart,
        }
    }
}

impl AssociationConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("planes.map.association.max_angle_deg", self.max_angle_deg, 0.1..=90.0)?;
        check_range("planes.map.association.max_distance", self.max_distance, 0.0..=10.0)?;
        check_range("planes.map.association.max_gap", self.max_gap, 0.0..=10.0)?;
        check_range("planes.map.association.max_occluded_gap", self.max_occluded_gap, 0.0..=10.0)
    }
}
