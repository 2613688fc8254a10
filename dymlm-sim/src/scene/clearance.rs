use dymlm_geometry::PointTree;
use parry3d::math::{Pose3, Vec3};

use super::Part;

/// Distance that things keep from places where somebody or something passes. In a building these are hundreds of
/// thousands, of which few are near a thing.
pub(super) struct Clearance {
    places: Vec<Vec3>,
    tree: PointTree,
    /// Metres.
    distance: f32,
}

impl Clearance {
    /// From the origins of poses.
    pub(super) fn from_all(poses: &[Pose3], distance: f32) -> Self {
        let places: Vec<Vec3> = poses.iter().map(|pose| pose.translation).collect();
        let points: Vec<_> = places.iter().map(Vec3::to_array).collect();
        Self { tree: PointTree::new(&points), places, distance }
    }

    /// Whether the bounding boxes of all bodies are farther away than the distance.
    pub(super) fn is_kept_by(&self, parts: &[Part]) -> bool {
        parts.iter().all(|part| {
            let half = part.shape.half_extents();
            // A thousandth more, since both are rounded.
            let reach = 1.001 * (half.length() + self.distance);
            let mut near = self.tree.within(part.scene_from_part.translation.to_array(), reach);
            near.all(|place| {
                let local = part.scene_from_part.inverse_transform_point(self.places[place]);
                (local.abs() - half).max(Vec3::ZERO).length() > self.distance
            })
        })
    }
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use parry3d::math::Rot3;
    use parry3d::shape::Cuboid;
    use rand::RngExt;

    use super::*;
    use crate::noise::{Use, stream};
    use crate::scene::Shape;
    use crate::scene::palette::FABRIC;

    #[test]
    fn is_what_a_look_at_all_places_finds() {
        let mut rng = stream(1, Use::Scene, 0, 0);
        let mut pose = |far: f32| {
            let at = Vec3::from_array([(); 3].map(|()| rng.random_range(-far..far)));
            let turn = Vec3::from_array([(); 3].map(|()| rng.random_range(-PI..PI)));
            Pose3::from_parts(at, Rot3::from_scaled_axis(turn))
        };
        let poses: Vec<Pose3> = (0..300).map(|_| pose(5.0)).collect();
        let mut kept = 0;
        for step in 0..400_u16 {
            let half = Vec3::new(0.05, 0.3, 0.01 * f32::from(step % 100));
            let shape = Shape::Cuboid(Cuboid::new(half));
            let part = Part { instance: 0, shape, scene_from_part: pose(5.0), material: FABRIC };
            let distance = 0.5 * f32::from(step % 7);
            let is_far = |place: &Pose3| {
                let local = part.scene_from_part.inverse_transform_point(place.translation);
                (local.abs() - half).max(Vec3::ZERO).length() > distance
            };
            let expected = poses.iter().all(is_far);
            assert_eq!(Clearance::from_all(&poses, distance).is_kept_by(&[part]), expected, "{step}");
            kept += usize::from(expected);
        }
        assert!((50..350).contains(&kept), "{kept} of 400");
    }
}
