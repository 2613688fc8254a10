use dymlm_core::vector3::{cross, difference, dot, unit};
use dymlm_core::{DepthImage, DepthNoise, Frame, PinholeCamera, Pose, SplitMix64};

/// A rectangle in the world: centre and two half sides, which are at right angles.
#[derive(Debug, Clone, Copy)]
pub struct Rectangle {
    /// Centre.
    pub center: [f64; 3],
    /// From the centre to the middles of two sides.
    pub half_sides: [[f64; 3]; 2],
}

/// An upright cylinder without caps.
#[derive(Debug, Clone, Copy)]
pub struct Cylinder {
    /// Centre of its foot.
    pub foot: [f64; 3],
    /// Radius.
    pub radius: f64,
    /// Height along z.
    pub height: f64,
}

/// A box in any orientation.
#[derive(Debug, Clone, Copy)]
pub struct Cuboid {
    /// Its own frame: origin at the centre, axes along the sides.
    pub world_from_cuboid: Pose,
    /// Full lengths along its axes.
    pub lengths: [f64; 3],
}

/// A few exact bodies that rays are cast at, for tests that need no rendered room. Metres.
#[derive(Debug, Clone, Default)]
pub struct World {
    /// Rectangles.
    pub rectangles: Vec<Rectangle>,
    /// Cylinders.
    pub cylinders: Vec<Cylinder>,
    /// Boxes.
    pub cuboids: Vec<Cuboid>,
}

/// The first hit of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Length of the ray, in units of its direction.
    pub length: f64,
    /// Index of the box that is hit; `None` for other bodies.
    pub cuboid: Option<usize>,
}

impl Rectangle {
    /// A level rectangle.
    pub fn level(center: [f64; 3], half_x: f64, half_y: f64) -> Self {
        Self { center, half_sides: [[half_x, 0.0, 0.0], [0.0, half_y, 0.0]] }
    }

    /// An upright rectangle perpendicular to y.
    pub fn upright(center: [f64; 3], half_x: f64, half_z: f64) -> Self {
        Self { center, half_sides: [[half_x, 0.0, 0.0], [0.0, 0.0, half_z]] }
    }

    fn cast(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        let [a, b] = self.half_sides;
        let normal = cross(a, b);
        let length = dot(normal, difference(self.center, origin)) / dot(normal, direction);
        let at: [f64; 3] =
            std::array::from_fn(|axis| origin[axis] + length * direction[axis] - self.center[axis]);
        let inside = [a, b].iter().all(|side| dot(*side, at).abs() <= dot(*side, *side));
        (length > 0.0 && length.is_finite() && inside).then_some(length)
    }
}

impl Cylinder {
    fn cast(&self, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        let from = difference(origin, self.foot);
        let a = direction[0].powi(2) + direction[1].powi(2);
        let b = from[0] * direction[0] + from[1] * direction[1];
        let c = from[0].powi(2) + from[1].powi(2) - self.radius.powi(2);
        let root = b * b - a * c;
        let length = (-b - root.sqrt()) / a;
        let height = from[2] + length * direction[2];
        (root >= 0.0 && length > 0.0 && (0.0..=self.height).contains(&height)).then_some(length)
    }
}

impl Cuboid {
    fn cast(&self, cuboid_from_world: &Pose, origin: [f64; 3], direction: [f64; 3]) -> Option<f64> {
        let (start, along) = (cuboid_from_world.transform_point(origin), cuboid_from_world.rotate(direction));
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for axis in 0..3 {
            let half = 0.5 * self.lengths[axis];
            let [a, b] = [-half, half].map(|side| (side - start[axis]) / along[axis]);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        (enter <= leave).then_some(enter)
    }
}

impl World {
    /// A world of rectangles only.
    pub fn of(rectangles: &[Rectangle]) -> Self {
        Self { rectangles: rectangles.to_vec(), ..Self::default() }
    }

    /// The hits of the rays through the pixels' centres, row by row; their lengths are depths.
    pub fn view(&self, camera: &PinholeCamera, world_from_camera: &Pose) -> Vec<Option<Hit>> {
        let origin = world_from_camera.translation();
        let cuboids: Vec<(&Cuboid, Pose)> =
            self.cuboids.iter().map(|own| (own, own.world_from_cuboid.inverse())).collect();
        let cast = |direction: [f64; 3]| {
            let others = self.rectangles.iter().filter_map(|body| body.cast(origin, direction));
            let others = others.chain(self.cylinders.iter().filter_map(|body| body.cast(origin, direction)));
            let others = others.map(|length| Hit { length, cuboid: None });
            let of_cuboid = |(index, (body, pose)): (usize, &(&Cuboid, Pose))| {
                let length = body.cast(pose, origin, direction)?;
                Some(Hit { length, cuboid: Some(index) })
            };
            let hits = others.chain(cuboids.iter().enumerate().filter_map(of_cuboid));
            hits.min_by(|a, b| a.length.total_cmp(&b.length))
        };
        let pixels = (0..camera.width() * camera.height()).map(|pixel| {
            let ray =
                camera.back_project([(pixel % camera.width()) as f64, (pixel / camera.width()) as f64], 1.0);
            cast(world_from_camera.rotate(ray))
        });
        pixels.collect()
    }

    /// The exact depth image; 0 where a ray hits nothing.
    pub fn depth(&self, camera: &PinholeCamera, world_from_camera: &Pose) -> DepthImage {
        self.image(camera, world_from_camera, |_, exact| exact as f32)
    }

    /// A frame of a good Kinect: half of the usual axial noise, and disparity steps of 1/8 pixel. The noise
    /// depends on `seed` alone, which is also the frame's time.
    pub fn frame(&self, camera: PinholeCamera, world_from_camera: &Pose, seed: u64) -> Frame {
        let noise = DepthNoise::kinect();
        let depth = self.image(&camera, world_from_camera, |pixel, exact| {
            let mut random = SplitMix64::new(seed << 32 ^ pixel as u64);
            // A sum of twelve uniform numbers has a standard deviation of 1.
            let normal = (0..12).map(|_| random.fraction()).sum::<f64>() - 6.0;
            let z = exact + 0.5 * f64::from(noise.sigma(exact as f32)) * normal;
            let steps = (1.0 / (0.002_85 * z)).round();
            (1.0 / (0.002_85 * steps)) as f32
        });
        Frame::new(seed as f64, camera, depth, None).unwrap()
    }

    fn image(
        &self,
        camera: &PinholeCamera,
        world_from_camera: &Pose,
        reading: impl Fn(usize, f64) -> f32,
    ) -> DepthImage {
        let hits = self.view(camera, world_from_camera).into_iter().enumerate();
        let data = hits.map(|(pixel, hit)| hit.map_or(0.0, |hit| reading(pixel, hit.length)));
        DepthImage::new(camera.width(), camera.height(), data.collect()).unwrap()
    }
}

/// The pose of a camera at `eye` that looks at `target`, which must not be straight above or below it; z is
/// up.
pub fn look_at(eye: [f64; 3], target: [f64; 3]) -> Pose {
    let forward = unit(difference(target, eye)).unwrap();
    let right = unit(cross(forward, [0.0, 0.0, 1.0])).unwrap();
    let down = cross(forward, right);
    let rows = std::array::from_fn(|axis| [right[axis], down[axis], forward[axis]]);
    Pose::from_rotation_matrix(rows, eye).unwrap()
}

/// 320x240 pixels, a Kinect's field of view.
pub fn small_camera() -> PinholeCamera {
    PinholeCamera::new(320, 240, 262.5, 262.5, 159.5, 119.5).unwrap()
}
