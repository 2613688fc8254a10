use parry3d::math::Vec3;
use parry3d::query::Ray;

use super::{Part, Shape};

/// The first thing that the line from one point to another hits; a room's walls do not count.
pub(super) fn first_hit(parts: &[Part], from: Vec3, to: Vec3) -> Option<usize> {
    let way = to - from;
    let mut nearest = (1.0, None);
    for part in parts.iter().filter(|part| !matches!(part.shape, Shape::Interior(_))) {
        // Most parts are far from the line.
        let center = part.scene_from_part.translation - from;
        let along = (center.dot(way) / way.length_squared()).clamp(0.0, 1.0);
        if (center - along * way).length_squared() > part.shape.half_extents().length_squared() {
            continue;
        }
        let origin = part.scene_from_part.inverse_transform_point(from);
        let dir = part.scene_from_part.rotation.inverse() * way;
        if let Some(t) = part.shape.cast(&Ray::new(origin, dir), nearest.0).filter(|&t| t < nearest.0) {
            nearest = (t, Some(part.instance));
        }
    }
    nearest.1
}
