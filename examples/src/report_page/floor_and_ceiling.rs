use dymlm::PlaneMap;
use dymlm::core::PointCloud;
use dymlm::core::vector3::{dot, unit};
use dymlm::planes::MapPlane;

use crate::any_level_direction;

/// Sine of the largest angle at which a plane still counts as level or upright, about 12 degrees.
const LEVEL_SINE: f64 = 0.2;
/// Smallest area of a floor or ceiling, square metres: smaller planes are table tops or shelves.
const LEAST_AREA: f64 = 0.5;
/// Smallest height of a room, metres.
const LEAST_HEIGHT: f64 = 1.8;

/// The floor, ceiling and orientation of a room in the world.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct FloorAndCeiling {
    /// A level direction along the walls, if there are any.
    pub(super) level: [f64; 3],
    /// Height of the floor along up, metres.
    pub(super) floor: f64,
    /// Height of the ceiling, if one was seen.
    pub(super) ceiling: Option<f64>,
}

impl FloorAndCeiling {
    /// Finds these by the planes of a map, and by the cloud when no plane is a floor.
    pub(super) fn find(planes: &PlaneMap, cloud: &PointCloud, up: [f64; 3]) -> Self {
        let large: Vec<(&MapPlane, f64)> = planes
            .iter()
            .map(|plane| (plane, plane.area()))
            .filter(|(_, area)| *area >= LEAST_AREA)
            .collect();
        let rise = |plane: &MapPlane| dot(plane.plane().normal(), up);
        let heights = |sign: f64| {
            let facing = large
                .iter()
                .filter(move |(plane, _)| sign * rise(plane) > 1.0 - LEVEL_SINE * LEVEL_SINE / 2.0);
            facing.map(|(plane, _)| dot(plane.centroid(), up))
        };
        let floor = heights(1.0).min_by(f64::total_cmp).unwrap_or_else(|| lowest(cloud, up));
        let ceiling = heights(-1.0).max_by(f64::total_cmp).filter(|height| *height > floor + LEAST_HEIGHT);
        let walls = large.iter().filter(|(plane, _)| rise(plane).abs() < LEVEL_SINE);
        let wall = walls.max_by(|a, b| a.1.total_cmp(&b.1));
        let along_up = |normal: [f64; 3]| {
            let rise = dot(normal, up);
            unit(std::array::from_fn(|axis| normal[axis] - rise * up[axis]))
        };
        let level = wall.and_then(|(plane, _)| along_up(plane.plane().normal()));
        Self { level: level.unwrap_or_else(|| any_level_direction(up)), floor, ceiling }
    }
}

/// The height below which one point in a hundred is.
fn lowest(cloud: &PointCloud, up: [f64; 3]) -> f64 {
    let height = |point: &[f32; 3]| dot(point.map(f64::from), up);
    let mut heights: Vec<f64> =
        cloud.points().iter().map(height).filter(|height| height.is_finite()).collect();
    heights.sort_unstable_by(f64::total_cmp);
    heights.get(heights.len() / 100).copied().unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use dymlm::MapConfig;

    #[test]
    fn without_planes_the_cloud_tells_the_floor() {
        let config = MapConfig::default();
        let planes = PlaneMap::new(config.planes.map, config.sensor).unwrap();
        let points = (0..1000).map(|i| [0.0, 0.0, -i as f32 * 0.001]).collect();
        let found = FloorAndCeiling::find(&planes, &PointCloud::new(points), [0.0, 0.0, 1.0]);
        assert!((found.floor + 0.989).abs() < 1e-3 && found.ceiling.is_none(), "{found:?}");
        assert_eq!(dot(found.level, [0.0, 0.0, 1.0]), 0.0);
        assert_eq!(FloorAndCeiling::find(&planes, &PointCloud::default(), [0.0, 1.0, 0.0]).floor, 0.0);
    }
}
