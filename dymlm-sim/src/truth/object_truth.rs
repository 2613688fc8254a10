use std::f64::consts::PI;

use dymlm_core::vector3::{cross, difference, dot};
use dymlm_core::{Point, Pose};
use dymlm_geometry::OrientedBox;
use dymlm_metrics::{TrueObject, VoxelKey, VoxelMap, YawSymmetry};
use parry3d::math::Pose3;

use super::surface_samples::surface_samples;
use crate::scene::{Motion, Part, Scene, Shape};
use crate::to_pose::to_pose;

/// The labelled static things of a scene, and what was seen of them.
#[derive(Debug, Clone)]
pub(super) struct ObjectTruth {
    objects: Vec<SceneObject>,
    /// The object of each static part.
    object_of_part: Vec<Option<u32>>,
    cubes_per_metre: f32,
}

#[derive(Debug, Clone)]
struct SceneObject {
    id: usize,
    label: &'static str,
    thing_from_scene: Pose,
    box_in_scene: OrientedBox,
    is_round: bool,
    /// Cubes of the thing's frame that its surface passes through.
    surface: VoxelMap<CubeViews>,
    /// Pixels that show the object in the current frame.
    pixels: usize,
    frames: u32,
}

#[derive(Debug, Clone, Copy, Default)]
struct CubeViews {
    frames: u32,
    last_frame: u32,
}

impl ObjectTruth {
    /// The objects, their surface sampled in cubes of side `cube` metres.
    pub(super) fn new(scene: &Scene, cube: f64) -> Self {
        let mut truth = Self {
            objects: Vec::new(),
            object_of_part: vec![None; scene.static_parts.len()],
            cubes_per_metre: (1.0 / cube) as f32,
        };
        for (id, thing) in scene.instances.iter().enumerate() {
            let parts: Vec<&Part> = scene.static_parts.iter().filter(|part| part.instance == id).collect();
            let (Some(label), Motion::Still) = (thing.label, thing.motion) else { continue };
            let Some(object) = SceneObject::new(id, label, &thing.scene_from_thing, &parts, cube) else {
                continue;
            };
            for (part, object) in scene.static_parts.iter().zip(&mut truth.object_of_part) {
                if part.instance == id {
                    *object = u32::try_from(truth.objects.len()).ok();
                }
            }
            truth.objects.push(object);
        }
        truth
    }

    /// Notes that a pixel of frame number `frame` (from 1) shows `point` (in the scene's frame) on the static
    /// body `part`.
    #[inline]
    pub(super) fn see(&mut self, part: u16, point: [f64; 3], frame: u32) {
        let Some(&Some(object)) = self.object_of_part.get(usize::from(part)) else { return };
        let object = &mut self.objects[object as usize];
        object.pixels += 1;
        let local = object.thing_from_scene.transform_point(point).map(|c| c as f32);
        let cube = VoxelKey::on_surface(local, self.cubes_per_metre);
        if let Some(views) = cube.and_then(|cube| object.surface.get_mut(&cube)) {
            views.frames += u32::from(views.last_frame != frame);
            views.last_frame = frame;
        }
    }

    /// Ends a frame: objects with at least `min_pixels` pixels were visible in it.
    pub(super) fn end_frame(&mut self, min_pixels: f64) {
        for object in &mut self.objects {
            object.frames += u32::from(object.pixels as f64 >= min_pixels);
            object.pixels = 0;
        }
    }

    /// The objects in the world; surface that at least `min_views` frames saw counts as seen.
    pub(super) fn in_world(&self, world_from_scene: &Pose, min_views: u32) -> Vec<TrueObject> {
        let objects = self.objects.iter();
        objects
            .map(|object| {
                let seen = object.surface.values().filter(|views| views.frames >= min_views).count();
                let in_world = object.box_in_scene.transformed(world_from_scene);
                let mut truth = TrueObject::new(object.id, object.label, in_world, object.frames);
                if object.is_round {
                    truth.symmetry = YawSymmetry::Full;
                }
                truth.visible_share = seen as f64 / object.surface.len().max(1) as f64;
                truth
            })
            .collect()
    }
}

impl SceneObject {
    fn new(
        id: usize,
        label: &'static str,
        scene_from_thing: &Pose3,
        parts: &[&Part],
        cube: f64,
    ) -> Option<Self> {
        let scene_from_thing = to_pose(scene_from_thing);
        let thing_from_scene = scene_from_thing.inverse();
        let box_in_scene = box_around(&scene_from_thing, parts)?;
        Some(Self {
            id,
            label,
            thing_from_scene,
            box_in_scene,
            is_round: is_round(&box_in_scene, parts),
            surface: surface_cubes(&thing_from_scene, parts, cube),
            pixels: 0,
            frames: 0,
        })
    }
}

/// The smallest box around bodies along the axes of the thing that they belong to.
pub(crate) fn box_around(scene_from_thing: &Pose, parts: &[&Part]) -> Option<OrientedBox> {
    let (center, lengths) = bounds_along(&scene_from_thing.inverse(), parts)?;
    OrientedBox::new(*scene_from_thing * at(center), lengths).ok()
}

/// A pose without rotation.
fn at(center: [f64; 3]) -> Pose {
    Pose::new(center, [0.0, 0.0, 0.0, 1.0]).unwrap_or_default()
}

/// Centre and full lengths of the bounds of bodies along a thing's axes; parts below the ground that the
/// thing stands on (z = 0 of its frame) are left out.
fn bounds_along(thing_from_scene: &Pose, parts: &[&Part]) -> Option<([f64; 3], [f64; 3])> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for part in parts {
        let thing_from_part = *thing_from_scene * to_pose(&part.scene_from_part);
        let (center, rows) = (thing_from_part.translation(), thing_from_part.rotation_matrix());
        for axis in 0..3 {
            let reach = reach(&part.shape, rows[axis]);
            low[axis] = low[axis].min(center[axis] - reach);
            high[axis] = high[axis].max(center[axis] + reach);
        }
    }
    if high[2] > 0.0 {
        low[2] = low[2].max(0.0);
    }
    let center = std::array::from_fn(|axis| 0.5 * (low[axis] + high[axis]));
    low.iter().chain(&high).all(|c| c.is_finite()).then(|| (center, difference(high, low)))
}

/// How far a body reaches from its centre along a unit direction of its own frame: its support function.
fn reach(shape: &Shape, direction: [f64; 3]) -> f64 {
    let half = shape.half_extents().to_array().map(f64::from);
    let [x, y, z] = direction.map(f64::abs);
    match shape {
        Shape::Cuboid(_) | Shape::Interior(_) => dot([x, y, z], half),
        Shape::Ellipsoid(_) => (0..3).map(|axis| (half[axis] * direction[axis]).powi(2)).sum::<f64>().sqrt(),
        // A capsule is a segment along y, grown by its radius in all directions.
        Shape::Capsule(_) => (half[1] - half[0]) * y + half[0],
        Shape::Cylinder(_) => half[1] * y + half[0] * x.hypot(z),
    }
}

/// Whether most of a thing's volume is rotationally symmetric about one vertical axis.
fn is_round(thing: &OrientedBox, parts: &[&Part]) -> bool {
    let up = thing.world_from_box().rotate([0.0, 0.0, 1.0]);
    let volumes: Vec<f64> = parts.iter().map(|part| volume(&part.shape)).collect();
    let Some((largest, _)) = parts.iter().zip(&volumes).max_by(|a, b| a.1.total_cmp(b.1)) else {
        return false;
    };
    let axis_at = to_pose(&largest.scene_from_part).translation();
    let turns_about_axis = |part: &&Part| {
        let pose = to_pose(&part.scene_from_part);
        let offset = difference(pose.translation(), axis_at);
        let radius = f64::from(part.shape.half_extents().x);
        dot(cross(offset, up), cross(offset, up)).sqrt() <= 0.1 * radius && turns_about(part, &pose, up)
    };
    let round: f64 =
        parts.iter().zip(&volumes).filter(|(part, _)| turns_about_axis(part)).map(|(_, volume)| volume).sum();
    round >= 0.8 * volumes.iter().sum::<f64>()
}

/// Whether a body is rotationally symmetric about the direction `up` through its centre.
fn turns_about(part: &Part, pose: &Pose, up: [f64; 3]) -> bool {
    let aligned = |axis: [f64; 3]| dot(pose.rotate(axis), up).abs() > 0.999;
    let [x, y, z] = part.shape.half_extents().to_array();
    match part.shape {
        Shape::Cuboid(_) | Shape::Interior(_) => false,
        Shape::Capsule(_) | Shape::Cylinder(_) => aligned([0.0, 1.0, 0.0]),
        Shape::Ellipsoid(_) => {
            let same = |a: f32, b: f32| (a - b).abs() < 1e-3 * a;
            (same(x, y) && (same(y, z) || aligned([0.0, 0.0, 1.0])))
                || (same(y, z) && aligned([1.0, 0.0, 0.0]))
                || (same(x, z) && aligned([0.0, 1.0, 0.0]))
        }
    }
}

/// Volume of a body, cubic metres.
fn volume(shape: &Shape) -> f64 {
    let [x, y, z] = shape.half_extents().to_array().map(f64::from);
    match shape {
        Shape::Cuboid(_) | Shape::Interior(_) => 8.0 * x * y * z,
        Shape::Ellipsoid(_) => 4.0 / 3.0 * PI * x * y * z,
        Shape::Capsule(_) => PI * x * x * (2.0 * (y - x) + 4.0 / 3.0 * x),
        Shape::Cylinder(_) => 2.0 * PI * x * x * y,
    }
}

/// The cubes of a thing's frame that its surface passes through, without surface inside another of its parts.
fn surface_cubes(thing_from_scene: &Pose, parts: &[&Part], cube: f64) -> VoxelMap<CubeViews> {
    let mut cubes = VoxelMap::default();
    for (index, part) in parts.iter().enumerate() {
        let others = || parts.iter().enumerate().filter(|&(other, _)| other != index).map(|(_, part)| part);
        let thing_from_part = *thing_from_scene * to_pose(&part.scene_from_part);
        for sample in surface_samples(&part.shape, 0.25 * cube as f32) {
            let in_scene = part.scene_from_part.transform_point(sample);
            let buried = |other: &&Part| {
                other.shape.reaches(other.scene_from_part.inverse_transform_point(in_scene), 0.0)
            };
            if others().any(buried) {
                continue;
            }
            let local: Point =
                thing_from_part.transform_point(sample.to_array().map(f64::from)).map(|c| c as f32);
            let above_ground = local[2] >= 0.0;
            if let Some(cube) = VoxelKey::on_surface(local, (1.0 / cube) as f32).filter(|_| above_ground) {
                cubes.entry(cube).or_default();
            }
        }
    }
    cubes
}
