use dymlm_core::vector3::{dot, unit};
use dymlm_planes::MapPlane;

use crate::MultiLevelMap;

/// Cosine of how far a floor may be tilted: 18 degrees.
const LEVEL: f64 = 0.95;
/// The share of the largest level plane's area from which on a plane may be the floor: steps down and
/// thresholds are smaller.
const LARGE: f64 = 0.25;

impl MultiLevelMap {
    /// The height of the floor along `up` from the world's origin, metres: of the lowest of the large level
    /// planes that face upward. `None` where there is none, and for an `up` without direction. O(voxels of
    /// the level planes).
    pub fn floor_height(&self, up: [f64; 3]) -> Option<f64> {
        let up = unit(up)?;
        let level = || self.planes.iter().filter(|plane| dot(plane.plane().normal(), up) > LEVEL);
        let largest = level().map(MapPlane::area).fold(0.0, f64::max);
        let large = level().filter(|plane| plane.area() > LARGE * largest);
        large.map(|plane| -plane.plane().d()).min_by(f64::total_cmp)
    }
}
