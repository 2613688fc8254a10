use parry3d::math::Vec3;
use parry3d::query::Ray;

use crate::scene::Shape;

/// Points of a convex body's surface, in its own frame: grid points on its bounding box, `spacing` metres
/// apart, are projected towards its centre onto the surface.
pub(super) fn surface_samples(shape: &Shape, spacing: f32) -> Vec<Vec3> {
    let half = shape.half_extents();
    let mut samples = Vec::new();
    for axis in 0..3 {
        let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
        let steps = |axis: usize| (2.0 * half[axis] / spacing).ceil().clamp(1.0, 4000.0) as usize;
        for i in 0..steps(u) {
            for j in 0..steps(v) {
                for side in [-1.0, 1.0] {
                    let mut on_box = Vec3::ZERO;
                    on_box[axis] = side * half[axis];
                    on_box[u] = half[u] * ((2 * i + 1) as f32 / steps(u) as f32 - 1.0);
                    on_box[v] = half[v] * ((2 * j + 1) as f32 / steps(v) as f32 - 1.0);
                    // The ray begins a little outside: one that begins on the surface may hit nothing.
                    let ray = Ray::new(1.1 * on_box, -on_box);
                    samples.extend(shape.cast(&ray, 1.1).map(|t| ray.point_at(t)));
                }
            }
        }
    }
    samples
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_lie_on_the_surface_and_leave_no_gap() {
        for shape in [
            Shape::cuboid(Vec3::new(0.2, 0.05, 0.1)),
            Shape::Ellipsoid(Vec3::new(0.1, 0.2, 0.05)),
            Shape::capsule(0.2, 0.05),
            Shape::cylinder(0.1, 0.05),
        ] {
            let samples = surface_samples(&shape, 0.005);
            assert!(samples.iter().all(|&sample| shape.surface_distance(sample) < 1e-5), "{shape:?}");
            // Every point that a ray from far away hits has a sample nearby.
            for k in 0..200 {
                let z = 1.0 - 2.0 * (k as f32 + 0.5) / 200.0;
                let (sin, cos) = (k as f32 * 2.399_963_2).sin_cos();
                let ring = (1.0 - z * z).sqrt();
                let from = Vec3::new(ring * cos, ring * sin, z);
                let target = 0.3 * shape.half_extents() * Vec3::new(sin, z, cos);
                let ray = Ray::new(from, target - from);
                let hit = ray.point_at(shape.cast(&ray, 2.0).unwrap());
                let nearest = samples.iter().map(|&sample| (sample - hit).length()).fold(1.0, f32::min);
                assert!(nearest < 0.01, "{shape:?}: {nearest} m from {hit}");
            }
        }
    }
}
