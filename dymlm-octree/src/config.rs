use dymlm_core::{ConfigError, check_range};

/// Which rays of a scan are followed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum RayMode {
    /// One ray for each distinct cell that holds points, to the cell's centre: OctoMap's
    /// `insertPointCloud(.., discretize = true)`. Much faster on depth frames, where many pixels share a
    /// cell.
    #[default]
    PerCell,
    /// One ray for each point, to the point itself: OctoMap's default.
    PerPoint,
}

/// Settings of an [`Octree`](crate::Octree). The defaults are OctoMap's, with the range limit of an indoor
/// depth camera.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct OctreeConfig {
    /// Side of the smallest cell, metres, `1e-4..=1e4`. The map spans 65536 cells along each axis, with the
    /// world's origin at its centre. Default 0.05, common for rooms.
    pub resolution: f64,
    /// Greatest distance from the sensor at which a reading hits its cell, metres; readings beyond it only
    /// free the cells up to this distance. Any positive value, infinite (in JSON: null) for no limit. Default
    /// 5.0: beyond 5 m a structured-light camera's depth error exceeds a cell.
    #[cfg_attr(feature = "serde", serde(deserialize_with = "dymlm_core::null_is_infinite"))]
    pub max_range: f64,
    /// Probability that a cell is occupied given one hit, `0.5..=0.999999`. Default 0.7 (`OctoMap`).
    pub p_hit: f64,
    /// Probability that a cell is occupied given one miss, `1e-6..=0.499999`. Default 0.4 (`OctoMap`).
    pub p_miss: f64,
    /// Lowest probability a cell can reach, `1e-6..=0.499999`. Default 0.1192, log-odds -2 (`OctoMap`).
    pub p_clamp_min: f64,
    /// Highest probability a cell can reach, `0.5..=0.999999`. Default 0.971, log-odds 3.5 (`OctoMap`).
    pub p_clamp_max: f64,
    /// Which rays of a scan are followed. Default: one for each distinct cell.
    pub rays: RayMode,
    /// Whether leaves carry a colour; then `.ot` files have the id `ColorOcTree`. The colours given with a
    /// scan are averaged within each cell, and the average is blended half and half with the colour the cell
    /// had (`averageNodeColor` in `OctoMap`). Default off.
    pub color: bool,
}

impl Default for OctreeConfig {
    fn default() -> Self {
        Self {
            resolution: 0.05,
            max_range: 5.0,
            p_hit: 0.7,
            p_miss: 0.4,
            p_clamp_min: 0.1192,
            p_clamp_max: 0.971,
            rays: RayMode::default(),
            color: false,
        }
    }
}

impl OctreeConfig {
    /// Checks every field against its range.
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("octree.resolution", self.resolution, 1e-4..=1e4)?;
        check_range("octree.max_range", self.max_range, f64::MIN_POSITIVE..=f64::INFINITY)?;
        check_range("octree.p_hit", self.p_hit, 0.5..=0.999_999)?;
        // Below one half: at it, a cell that rays have passed would count as occupied.
        check_range("octree.p_miss", self.p_miss, 1e-6..=0.499_999)?;
        check_range("octree.p_clamp_min", self.p_clamp_min, 1e-6..=0.499_999)?;
        check_range("octree.p_clamp_max", self.p_clamp_max, 0.5..=0.999_999)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[cfg(feature = "serde")]
    #[test]
    fn json_keeps_everything() {
        let mut config = OctreeConfig { max_range: f64::INFINITY, ..OctreeConfig::default() };
        (config.rays, config.color) = (RayMode::PerPoint, true);
        let json = serde_json::to_string(&config).unwrap();
        assert!(json.contains(r#""rays":"per_point","color":true"#), "{json}");
        assert_eq!(serde_json::from_str::<OctreeConfig>(&json).unwrap(), config);
        config.max_range = 2.5;
        let json = serde_json::to_string(&config).unwrap();
        assert_eq!(serde_json::from_str::<OctreeConfig>(&json).unwrap(), config);
        assert_eq!(serde_json::from_str::<OctreeConfig>("{}").unwrap(), OctreeConfig::default());
    }

    #[test]
    fn names_the_field_at_fault() {
        assert!(OctreeConfig::default().validate().is_ok());
        let config = OctreeConfig { resolution: -0.05, ..OctreeConfig::default() };
        assert_eq!(config.validate().unwrap_err().field, "octree.resolution");
        let config = OctreeConfig { max_range: f64::NAN, ..OctreeConfig::default() };
        assert_eq!(config.validate().unwrap_err().field, "octree.max_range");
        let config = OctreeConfig { p_clamp_max: 0.2, ..OctreeConfig::default() };
        assert_eq!(config.validate().unwrap_err().field, "octree.p_clamp_max");
        let config = OctreeConfig { p_miss: 0.5, ..OctreeConfig::default() };
        assert_eq!(config.validate().unwrap_err().field, "octree.p_miss");
        let config = OctreeConfig { p_clamp_min: 0.5, ..OctreeConfig::default() };
        assert_eq!(config.validate().unwrap_err().field, "octree.p_clamp_min");
    }
}
