//! A small ray caster for rooms of rectangles and cylinders, with a Kinect's noise: the tests' eyes.

#![allow(dead_code, clippy::unwrap_used, reason = "tests; not every test uses all of it")]

use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose, SensorModel};
use dymlm_planes::{MapPlane, PlaneConfig, PlaneDetector, PlaneMap, PlaneMapper};

/// A rectangle in the world: centre and two half sides, which are at right angles.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rectangle {
    pub(crate) center: [f64; 3],
    pub(crate) half_sides: [[f64; 3]; 2],
}

/// An upright cylinder without caps: centre of its foot, radius, height along z.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cylinder {
    pub(crate) foot: [f64; 3],
    pub(crate) radius: f64,
    pub(crate) height: f64,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct World {
    pub(crate) rectangles: Vec<Rectangle>,
    pub(crate) cylinders: Vec<Cylinder>,
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(crate) fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| a[axis] - b[axis])
}

fn scaled(a: [f64; 3], s: f64) -> [f64; 3] {
    a.map(|x| x * s)
}

pub(crate) fn unit(a: [f64; 3]) -> [f64; 3] {
    scaled(a, 1.0 / dot(a, a).sqrt())
}

/// A level rectangle.
pub(crate) fn level(center: [f64; 3], half_x: f64, half_y: f64) -> Rectangle {
    Rectangle { center, half_sides: [[half_x, 0.0, 0.0], [0.0, half_y, 0.0]] }
}

/// An upright rectangle across y.
pub(crate) fn upright(center: [f64; 3], half_x: f64, half_z: f64) -> Rectangle {
    Rectangle { center, half_sides: [[half_x, 0.0, 0.0], [0.0, 0.0, half_z]] }
}

impl World {
    pub(crate) fn of(rectangles: &[Rectangle]) -> Self {
        Self { rectangles: rectangles.to_vec(), cylinders: Vec::new() }
    }

    /// Length of the ray to the first surface, in units of `direction`.
    fn cast(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        let of_rectangles = self.rectangles.iter().filter_map(|rectangle| {
            let [a, b] = rectangle.half_sides;
            let normal = cross(a, b);
            let t = dot(normal, minus(rectangle.center, origin)) / dot(normal, direction);
            let at: [f64; 3] =
                std::array::from_fn(|axis| origin[axis] + t * direction[axis] - rectangle.center[axis]);
            let inside = [a, b].iter().all(|side| dot(*side, at).abs() <= dot(*side, *side));
            (t > 0.0 && t.is_finite() && inside).then_some(t)
        });
        let of_cylinders = self.cylinders.iter().filter_map(|cylinder| {
            let from = minus(origin, cylinder.foot);
            let a = direction[0].powi(2) + direction[1].powi(2);
            let b = from[0] * direction[0] + from[1] * direction[1];
            let c = from[0].powi(2) + from[1].powi(2) - cylinder.radius.powi(2);
            let root = b * b - a * c;
            let t = (-b - root.sqrt()) / a;
            let height = from[2] + t * direction[2];
            (root >= 0.0 && t > 0.0 && (0.0..=cylinder.height).contains(&height)).then_some(t)
        });
        of_rectangles.chain(of_cylinders).min_by(f64::total_cmp)
    }

    /// What a Kinect sees: axial noise (a sum of twelve uniform numbers from a counter-based generator, so the frame is a
    /// function of `seed` alone) and disparity steps of 1/8 pixel.
    pub(crate) fn frame(&self, camera: PinholeCamera, world_from_camera: &Pose, seed: u64) -> Frame {
        let (width, height) = (camera.width(), camera.height());
        let origin = world_from_camera.translation();
        let mut data = Vec::with_capacity(width * height);
        for v in 0..height {
            for u in 0..width {
                let ray = camera.back_project([u as f64, v as f64], 1.0);
                let exact = self.cast(origin, world_from_camera.rotate(ray)).unwrap_or(0.0);
                data.push(if exact > 0.0 { noisy(exact, seed, (v * width + u) as u64) } else { 0.0 });
            }
        }
        let depth = DepthImage::new(width, height, data).unwrap();
        Frame::new(seed as f64, camera, depth, None).unwrap()
    }
}

fn noisy(exact: f64, seed: u64, pixel: u64) -> f32 {
    let mut state = splitmix(seed ^ splitmix(pixel));
    let mut sum = -6.0;
    for _ in 0..12 {
        state = splitmix(state);
        sum += (state >> 11) as f64 / (1_u64 << 53) as f64;
    }
    // Half of Nguyen's noise, which is that of a good Kinect.
    let z = exact + 0.5 * f64::from(SensorModel::kinect().sigma(exact as f32)) * sum;
    let steps = (1.0 / (0.002_85 * z)).round();
    (1.0 / (0.002_85 * steps)) as f32
}

fn splitmix(x: u64) -> u64 {
    let x = x.wrapping_add(0x9E37_79B9_7F4A_7C15);
    let x = (x ^ (x >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let x = (x ^ (x >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    x ^ (x >> 31)
}

/// 320x240 pixels, a Kinect's field of view.
pub(crate) fn camera() -> PinholeCamera {
    PinholeCamera::new(320, 240, 262.5, 262.5, 159.5, 119.5).unwrap()
}

/// A camera at `eye` that looks at `target`; z is up.
pub(crate) fn look_at(eye: [f64; 3], target: [f64; 3]) -> Pose {
    let forward = unit(minus(target, eye));
    let right = unit(cross(forward, [0.0, 0.0, 1.0]));
    let down = cross(forward, right);
    let rows = std::array::from_fn(|axis| [right[axis], down[axis], forward[axis]]);
    Pose::from_rotation_matrix(rows, eye).unwrap()
}

/// A room's corner with a table: floor, two walls, a table top.
pub(crate) fn room() -> World {
    World::of(&[
        level([0.0, 0.0, 0.0], 3.0, 3.0),
        upright([0.0, 1.6, 1.2], 3.0, 1.2),
        Rectangle { center: [1.4, 0.0, 1.2], half_sides: [[0.0, 3.0, 0.0], [0.0, 0.0, 1.2]] },
        level([-0.2, 0.5, 0.75], 0.5, 0.35),
    ])
}

/// Six views of [`room`].
pub(crate) fn room_views() -> Vec<Pose> {
    (0..6)
        .map(|k| {
            let s = f64::from(k);
            look_at([-0.9 + 0.12 * s, -1.5 + 0.05 * s, 1.5 + 0.03 * s], [0.1 + 0.05 * s, 0.6, 0.6])
        })
        .collect()
}

pub(crate) fn mapper() -> PlaneMapper {
    PlaneMapper::new(PlaneConfig::default(), &SensorModel::kinect()).unwrap()
}

pub(crate) fn empty_map() -> PlaneMap {
    PlaneMap::new(PlaneConfig::default().map, &SensorModel::kinect()).unwrap()
}

pub(crate) fn detector() -> PlaneDetector {
    PlaneDetector::new(&PlaneConfig::default().detector, &SensorModel::kinect()).unwrap()
}

/// Confirmed planes and candidates, in the order of their ids.
pub(crate) fn all_planes(map: &PlaneMap) -> Vec<&MapPlane> {
    let mut planes: Vec<&MapPlane> = map.iter().chain(map.candidates()).collect();
    planes.sort_by_key(|plane| plane.id());
    planes
}

/// Copies of [`all_planes`].
pub(crate) fn snapshot(map: &PlaneMap) -> Vec<MapPlane> {
    all_planes(map).into_iter().cloned().collect()
}
