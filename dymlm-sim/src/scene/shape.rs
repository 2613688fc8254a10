use parry3d::math::{Pose3, Rot3, Vec3};
use parry3d::query::{PointQuery, Ray, RayCast};
use parry3d::shape::{Ball, Capsule, Cuboid, Cylinder};

/// A convex body about the origin of its own frame, or the inside of a cuboid.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Shape {
    Cuboid(Cuboid),
    /// A room: the walls of a cuboid seen from inside. All other bodies are inside, and so in front of the
    /// walls.
    Interior(Cuboid),
    /// Semi-axes along x, y, z.
    Ellipsoid(Vec3),
    /// Along y.
    Capsule(Capsule),
    /// Along y.
    Cylinder(Cylinder),
}

impl Shape {
    /// A body that is not there; no real body has zero size.
    pub(crate) const ABSENT: Self = Self::Ellipsoid(Vec3::ZERO);

    pub(crate) fn cuboid(half_extents: Vec3) -> Self {
        Self::Cuboid(Cuboid::new(half_extents))
    }

    pub(crate) fn capsule(half_height: f32, radius: f32) -> Self {
        Self::Capsule(Capsule::new_y(half_height, radius))
    }

    pub(crate) fn cylinder(half_height: f32, radius: f32) -> Self {
        Self::Cylinder(Cylinder::new(half_height, radius))
    }

    /// Half of the extents along x, y, z; the body is symmetric about its origin.
    pub(crate) fn half_extents(&self) -> Vec3 {
        match self {
            Self::Cuboid(cuboid) | Self::Interior(cuboid) => cuboid.half_extents,
            Self::Ellipsoid(radii) => *radii,
            Self::Capsule(capsule) => {
                Vec3::new(capsule.radius, capsule.segment.b.y.abs() + capsule.radius, capsule.radius)
            }
            Self::Cylinder(cylinder) => Vec3::new(cylinder.radius, cylinder.half_height, cylinder.radius),
        }
    }

    /// The parameter of the ray's first hit from outside (for a room: from inside), at most `farthest`; the
    /// direction need not be a unit vector. A ray from inside a body hits nothing.
    #[inline]
    pub(crate) fn cast(&self, ray: &Ray, farthest: f32) -> Option<f32> {
        let hit = match self {
            Self::Cuboid(cuboid) => cast_cuboid(cuboid.half_extents, ray, farthest).map(|[enters, _]| enters),
            // From inside, it is entered where the ray begins.
            Self::Interior(cuboid) => cast_cuboid(cuboid.half_extents, ray, farthest)
                .map(|[enters, leaves]| if enters == 0.0 { leaves } else { enters }),
            Self::Ellipsoid(radii) => {
                // Scaling the ellipsoid to the unit ball does not change the parameter of a hit.
                let scaled = Ray::new(ray.origin / *radii, ray.dir / *radii);
                Ball::new(1.0).cast_local_ray(&scaled, farthest, true)
            }
            Self::Capsule(capsule) => capsule.cast_local_ray(ray, farthest, true),
            Self::Cylinder(cylinder) => cast_cylinder(*cylinder, ray, farthest),
        };
        hit.filter(|&t| t > 0.0)
    }

    /// The unit normal at a point of the surface, outwards (for a room: inwards).
    #[inline]
    pub(crate) fn normal(&self, point: Vec3) -> Vec3 {
        match self {
            Self::Cuboid(cuboid) => face_normal(point / cuboid.half_extents),
            Self::Interior(cuboid) => -face_normal(point / cuboid.half_extents),
            Self::Ellipsoid(radii) => (point / (*radii * *radii)).normalize_or(Vec3::Z),
            Self::Capsule(capsule) => {
                let along = point.y.clamp(-capsule.segment.b.y.abs(), capsule.segment.b.y.abs());
                (point - Vec3::new(0.0, along, 0.0)).normalize_or(Vec3::Z)
            }
            Self::Cylinder(cylinder) => {
                let radial = (point.x * point.x + point.z * point.z).sqrt() / cylinder.radius;
                if point.y.abs() / cylinder.half_height > radial {
                    Vec3::new(0.0, point.y.signum(), 0.0)
                } else {
                    Vec3::new(point.x, 0.0, point.z).normalize_or(Vec3::X)
                }
            }
        }
    }

    /// Unsigned distance of a point to the surface, from outside or inside.
    pub(crate) fn surface_distance(&self, point: Vec3) -> f32 {
        match self {
            Self::Cuboid(cuboid) | Self::Interior(cuboid) => {
                cuboid.distance_to_local_point(point, false).abs()
            }
            Self::Ellipsoid(radii) => distance_to_ellipsoid(*radii, point),
            Self::Capsule(capsule) => capsule.distance_to_local_point(point, false).abs(),
            Self::Cylinder(cylinder) => cylinder.distance_to_local_point(point, false).abs(),
        }
    }

    /// Whether a point is in the body or within `margin` of it.
    pub(crate) fn reaches(&self, point: Vec3, margin: f32) -> bool {
        let is_room = matches!(self, Self::Interior(_));
        if !is_room && (point.abs() - self.half_extents()).max_element() > margin {
            return false;
        }
        if let Self::Ellipsoid(radii) = self {
            // Bounds decide for most points without the search for the nearest surface point.
            let scaled = (point / *radii).length();
            if scaled <= 1.0 || point.length() * (1.0 - 1.0 / scaled) < margin {
                return true;
            }
            if (scaled - 1.0) * radii.min_element() > 1.001 * margin {
                return false;
            }
        }
        let inside = match self {
            Self::Cuboid(cuboid) => cuboid.contains_local_point(point),
            Self::Interior(cuboid) => !cuboid.contains_local_point(point),
            Self::Ellipsoid(_) => false,
            Self::Capsule(capsule) => capsule.contains_local_point(point),
            Self::Cylinder(cylinder) => cylinder.contains_local_point(point),
        };
        inside || self.surface_distance(point) <= margin
    }
}

/// The axis along which a point of the unit cube's surface is farthest out.
#[inline]
pub(crate) fn face_normal(p: Vec3) -> Vec3 {
    let a = p.abs();
    if a.x >= a.y && a.x >= a.z {
        Vec3::new(p.x.signum(), 0.0, 0.0)
    } else if a.y >= a.z {
        Vec3::new(0.0, p.y.signum(), 0.0)
    } else {
        Vec3::new(0.0, 0.0, p.z.signum())
    }
}

/// Where a ray enters and leaves a box about the origin, from 0 to `farthest` (Kay and Kajiya, "Ray tracing
/// complex scenes", 1986). The same bits as parry's, but inlined and without branches: most rays meet boxes.
#[inline]
fn cast_cuboid(half_extents: Vec3, ray: &Ray, farthest: f32) -> Option<[f32; 2]> {
    let inverse = ray.dir.recip();
    let [low, high] = [-half_extents, half_extents].map(|side| (side - ray.origin) * inverse);
    let enters = low.min(high).max_element().max(0.0);
    let leaves = low.max(high).min_element().min(farthest);
    (enters <= leaves).then_some([enters, leaves])
}

/// First hit of a cylinder about y from outside. (parry casts rays at cylinders only by its general GJK
/// iteration.)
fn cast_cylinder(cylinder: Cylinder, ray: &Ray, farthest: f32) -> Option<f32> {
    let (origin, dir) = (ray.origin, ray.dir);
    let within = |t: f32| (t > 0.0 && t <= farthest).then_some(t);

    // The cap that faces the ray.
    let cap = if dir.y < 0.0 { cylinder.half_height } else { -cylinder.half_height };
    if dir.y != 0.0 {
        let t = (cap - origin.y) / dir.y;
        let hit = origin + dir * t;
        if t > 0.0 && hit.x * hit.x + hit.z * hit.z <= cylinder.radius * cylinder.radius {
            return within(t);
        }
    }

    // The side: the discriminant is computed at the closest approach to the axis, which avoids cancellation.
    let a = dir.x * dir.x + dir.z * dir.z;
    if a == 0.0 {
        return None;
    }
    let closest = -(origin.x * dir.x + origin.z * dir.z) / a;
    let (x, z) = (origin.x + dir.x * closest, origin.z + dir.z * closest);
    let discriminant = (cylinder.radius * cylinder.radius - (x * x + z * z)) / a;
    if discriminant < 0.0 {
        return None;
    }
    let t = closest - discriminant.sqrt();
    ((origin.y + dir.y * t).abs() <= cylinder.half_height).then_some(t).and_then(within)
}

/// Distance of a point to an ellipsoid's surface: the nearest point is (r^2 p / (r^2 + t)) for the largest
/// root t of sum (r p / (r^2 + t))^2 = 1, found by Newton's method outside and by bisection inside (Eberly, "Distance from a Point to an Ellipse,
/// an Ellipsoid, or a Hyperellipsoid", 2013).
fn distance_to_ellipsoid(radii: Vec3, point: Vec3) -> f32 {
    let r = radii.to_array().map(f64::from);
    let p = point.to_array().map(|c| f64::from(c.abs()));
    let smallest = r[0].min(r[1]).min(r[2]);
    let is_outside = sum(|i| (p[i] / r[i]).powi(2)) > 1.0;
    let root = if is_outside { root_outside(r, p, smallest) } else { root_inside(r, p, smallest) };

    let mut nearest = [0.0; 3];
    let mut shortest = None;
    let mut rest = 1.0;
    for i in 0..3 {
        let divisor = r[i] * r[i] + root;
        if divisor > 1e-9 * r[i] * r[i] {
            nearest[i] = r[i] * r[i] * p[i] / divisor;
            rest -= (r[i] * p[i] / divisor).powi(2);
        } else {
            shortest = Some(i);
        }
    }
    // For a point on a plane of symmetry near the centre, the nearest surface point is off that plane.
    if let Some(i) = shortest {
        nearest[i] = smallest * rest.max(0.0).sqrt();
    }
    sum(|i| (nearest[i] - p[i]).powi(2)).sqrt() as f32
}

/// The largest root t for a point outside, by Newton's method on 1 / sqrt(sum), which is concave and nearly linear in t
/// (More and Sorensen, "Computing a trust region step", 1983): from 0 it never passes the root.
fn root_outside(r: [f64; 3], p: [f64; 3], smallest: f64) -> f64 {
    let mut t = 0.0;
    for _ in 0..20 {
        let square = sum(|i| (r[i] * p[i] / (r[i] * r[i] + t)).powi(2));
        let slope = -2.0 * sum(|i| (r[i] * p[i]).powi(2) / (r[i] * r[i] + t).powi(3));
        let step = 2.0 * square * (1.0 - square.sqrt()) / slope;
        t += step;
        if step.abs() <= 1e-14 * (t + smallest * smallest) {
            break;
        }
    }
    t
}

/// The largest root t for a point inside, where the sum may have a pole close by: by bisection.
fn root_inside(r: [f64; 3], p: [f64; 3], smallest: f64) -> f64 {
    let mut low = -smallest * smallest;
    let mut high = low + sum(|i| (r[i] * p[i]).powi(2)).sqrt();
    for _ in 0..44 {
        let middle = 0.5 * (low + high);
        let is_low = sum(|i| (r[i] * p[i] / (r[i] * r[i] + middle)).powi(2)) > 1.0;
        if is_low { low = middle } else { high = middle }
    }
    high
}

/// The sum over the three axes.
fn sum(term: impl Fn(usize) -> f64) -> f64 {
    (0..3).map(term).sum()
}

/// The capsule whose axis runs from `a` to `b`.
pub(super) fn capsule_between(a: Vec3, b: Vec3, radius: f32) -> (Shape, Pose3) {
    let axis = b - a;
    let along = axis.normalize_or(Vec3::Y);
    let pose = Pose3::from_parts(0.5 * (a + b), Rot3::from_rotation_arc(Vec3::Y, along));
    (Shape::capsule(0.5 * axis.length(), radius), pose)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn shapes() -> Vec<Shape> {
        vec![
            Shape::cuboid(Vec3::new(0.3, 0.05, 0.8)),
            Shape::Ellipsoid(Vec3::new(0.1, 0.2, 0.35)),
            Shape::Ellipsoid(Vec3::splat(0.2)),
            Shape::capsule(0.3, 0.07),
            Shape::cylinder(0.25, 0.1),
        ]
    }

    fn vector(reach: f32) -> impl Strategy<Value = Vec3> {
        (-reach..reach, -reach..reach, -reach..reach).prop_map(|(x, y, z)| Vec3::new(x, y, z))
    }

    proptest! {
        #[test]
        fn rays_end_on_the_surface_and_face_it(origin in vector(4.0), target in vector(0.3)) {
            let ray = Ray::new(origin, 0.7 * (target - origin));
            for shape in shapes() {
                if shape.reaches(origin, 0.0) {
                    continue;
                }
                if let Some(t) = shape.cast(&ray, 1e3) {
                    let hit = ray.point_at(t);
                    prop_assert!(shape.surface_distance(hit) < 1e-4, "{shape:?}: {}", shape.surface_distance(hit));
                    prop_assert!(shape.normal(hit).dot(ray.dir) <= 1e-2 * ray.dir.length());
                    // No part of the body is before the hit.
                    for k in 1..20 {
                        let before = ray.point_at(t * 0.999 * k as f32 / 20.0);
                        prop_assert!(!shape.reaches(before, 0.0) || shape.surface_distance(before) < 1e-4);
                    }
                    prop_assert!(hit.abs().cmple(shape.half_extents() + 1e-4).all());
                } else {
                    for k in 0..60 {
                        let along = ray.point_at(k as f32 / 30.0);
                        prop_assert!(!shape.reaches(along, 0.0) || shape.surface_distance(along) < 1e-4);
                    }
                }
            }
        }

        #[test]
        fn boxes_are_hit_where_parry_hits_them(
            origin in vector(2.0),
            direction in prop::array::uniform3(prop_oneof![Just(0.0_f32), -1.0..1.0_f32]),
            farthest in 0.0..4.0_f32,
        ) {
            let (cuboid, ray) = (Cuboid::new(Vec3::new(0.3, 0.5, 0.8)), Ray::new(origin, direction.into()));
            for (shape, solid) in [(Shape::Cuboid(cuboid), true), (Shape::Interior(cuboid), false)] {
                let expected = cuboid.cast_local_ray(&ray, farthest, solid).filter(|&t| t > 0.0);
                prop_assert_eq!(shape.cast(&ray, farthest).map(f32::to_bits), expected.map(f32::to_bits));
            }
        }

        #[test]
        fn a_room_is_hit_from_within(origin in vector(0.99), direction in vector(1.0)) {
            prop_assume!(direction.length() > 0.1);
            let room = Shape::Interior(Cuboid::new(Vec3::new(1.0, 1.5, 2.0)));
            let ray = Ray::new(origin, direction);
            let hit = ray.point_at(room.cast(&ray, 1e3).unwrap());
            prop_assert!(room.surface_distance(hit) < 1e-4);
            prop_assert!(room.normal(hit).dot(direction) < 0.0);
        }

        #[test]
        fn the_distance_to_an_ellipsoid_is_that_to_its_nearest_sample(point in vector(0.6)) {
            let radii = Vec3::new(0.1, 0.2, 0.35);
            let sample = (0..40_000).map(|i| {
                // Fibonacci sphere, scaled.
                let z = 1.0 - 2.0 * (i as f32 + 0.5) / 40_000.0;
                let (sin, cos) = (i as f32 * 2.399_963_2).sin_cos();
                let ring = (1.0 - z * z).sqrt();
                (Vec3::new(ring * cos, ring * sin, z) * radii - point).length()
            }).fold(f32::INFINITY, f32::min);
            let distance = distance_to_ellipsoid(radii, point);
            prop_assert!((distance - sample).abs() < 4e-3, "{distance} against {sample}");
            prop_assert!(distance <= sample + 1e-5);
        }
    }

    #[test]
    fn the_centre_of_an_ellipsoid_is_its_shortest_axis_deep() {
        assert!((distance_to_ellipsoid(Vec3::new(0.1, 0.2, 0.35), Vec3::ZERO) - 0.1).abs() < 1e-6);
        assert!((distance_to_ellipsoid(Vec3::splat(0.2), Vec3::ZERO) - 0.2).abs() < 1e-6);
        assert!((distance_to_ellipsoid(Vec3::splat(0.2), Vec3::new(0.0, 0.5, 0.0)) - 0.3).abs() < 1e-6);
    }

    #[test]
    fn a_capsule_reaches_from_end_to_end() {
        for b in [Vec3::new(0.4, -0.2, 0.9), Vec3::new(0.1, -1.0, 0.3), Vec3::new(0.1, 0.2, 0.3)] {
            let a = Vec3::new(0.1, 0.2, 0.3);
            let (shape, pose) = capsule_between(a, b, 0.1);
            for end in [a, b] {
                let local = pose.inverse_transform_point(end);
                assert!((shape.surface_distance(local) - 0.1).abs() < 1e-5 && shape.reaches(local, 0.0));
            }
        }
    }
}
