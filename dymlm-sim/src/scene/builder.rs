use parry3d::math::{Pose3, Rot3, Vec3};
use parry3d::shape::Cuboid;

use super::person::{Action, Clothes};
use super::shape::capsule_between;
use super::{Instance, Material, Motion, Part, Person, Shape};

/// Puts a scene together thing by thing. A thing's parts are given in the thing's own frame: origin on the
/// floor (or on the surface that the thing stands on), z up, front towards -y.
#[derive(Debug, Default)]
pub(super) struct Builder {
    pub(super) parts: Vec<Part>,
    pub(super) instances: Vec<Instance>,
    pub(super) people: Vec<Person>,
    /// The door on the wall.
    pub(super) door: Option<usize>,
    scene_from_thing: Pose3,
}

/// Thickness of the floor, metres.
const FLOOR: f32 = 0.01;

impl Builder {
    /// Begins a thing that stays, at `place`, turned by `yaw` radians about z.
    pub(super) fn thing(&mut self, label: Option<&'static str>, place: [f32; 3], yaw: f32) -> &mut Self {
        self.scene_from_thing = Pose3::from_parts(place.into(), Rot3::from_rotation_z(yaw));
        let scene_from_thing = self.scene_from_thing;
        self.instances.push(Instance { label, motion: Motion::Still, scene_from_thing });
        self
    }

    /// A cuboid of full lengths `size` about `center`.
    pub(super) fn cuboid(&mut self, center: [f32; 3], size: [f32; 3], material: Material) -> &mut Self {
        let pose = Pose3::from_translation(center.into());
        self.part(Shape::cuboid(0.5 * Vec3::from(size)), pose, material)
    }

    /// A cuboid tilted by `pitch` radians about its x axis.
    pub(super) fn tilted(
        &mut self,
        center: [f32; 3],
        size: [f32; 3],
        pitch: f32,
        material: Material,
    ) -> &mut Self {
        let pose = Pose3::from_parts(center.into(), Rot3::from_rotation_x(pitch));
        self.part(Shape::cuboid(0.5 * Vec3::from(size)), pose, material)
    }

    /// An upright cylinder standing on `foot`.
    pub(super) fn cylinder(
        &mut self,
        foot: [f32; 3],
        height: f32,
        radius: f32,
        material: Material,
    ) -> &mut Self {
        let center = Vec3::from(foot) + Vec3::new(0.0, 0.0, 0.5 * height);
        let upright = Rot3::from_rotation_x(std::f32::consts::FRAC_PI_2);
        self.part(Shape::cylinder(0.5 * height, radius), Pose3::from_parts(center, upright), material)
    }

    /// A rod with round ends from `a` to `b`.
    pub(super) fn rod(&mut self, a: [f32; 3], b: [f32; 3], radius: f32, material: Material) -> &mut Self {
        let (shape, pose) = capsule_between(a.into(), b.into(), radius);
        self.part(shape, pose, material)
    }

    /// An ellipsoid of semi-axes `radii`.
    pub(super) fn ellipsoid(&mut self, center: [f32; 3], radii: [f32; 3], material: Material) -> &mut Self {
        self.part(Shape::Ellipsoid(radii.into()), Pose3::from_translation(center.into()), material)
    }

    /// Any shape at a pose in the thing's frame.
    pub(super) fn part(&mut self, shape: Shape, thing_from_part: Pose3, material: Material) -> &mut Self {
        let scene_from_part = self.scene_from_thing * thing_from_part;
        let instance = self.instances.len().saturating_sub(1);
        self.parts.push(Part { shape, scene_from_part, material, instance });
        self
    }

    /// A room of full lengths `size` about (`x`, `y`), and a floor 1 cm thick whose top is z = 0.
    pub(super) fn walls_and_floor(
        &mut self,
        [x, y]: [f32; 2],
        size: [f32; 3],
        walls: Material,
        floor: Material,
    ) -> &mut Self {
        let half = 0.5 * Vec3::from(size);
        let pose = Pose3::from_translation(Vec3::new(x, y, half.z - FLOOR));
        self.thing(None, [0.0; 3], 0.0).part(Shape::Interior(Cuboid::new(half)), pose, walls);
        let covered = [size[0] - 0.01, size[1] - 0.01, FLOOR];
        self.thing(None, [0.0; 3], 0.0).cuboid([x, y, -0.5 * FLOOR], covered, floor)
    }

    /// A door of 0.9 x 2.06 m, flat on a wall.
    pub(super) fn door(&mut self, [x, y]: [f32; 2], yaw: f32, material: Material) -> &mut Self {
        self.door = Some(self.instances.len());
        self.thing(None, [x, y, 0.0], yaw).cuboid([0.0, 0.0, 1.03], [0.9, 0.06, 2.06], material)
    }

    /// Adds everything that another builder built, with its origin at the given pose.
    pub(super) fn join(&mut self, built: Self, scene_from_built: Pose3) {
        let first = self.instances.len();
        self.instances.extend(
            built.instances.into_iter().map(|thing| Instance {
                scene_from_thing: scene_from_built * thing.scene_from_thing,
                ..thing
            }),
        );
        self.parts.extend(built.parts.into_iter().map(|part| Part {
            scene_from_part: scene_from_built * part.scene_from_part,
            instance: first + part.instance,
            ..part
        }));
    }

    /// Adds a person of the given `height` in metres, whose actions are given in a room's frame. People come
    /// after all things that stay.
    pub(super) fn person(
        &mut self,
        action: Action,
        scene_from_room: Pose3,
        height: f32,
        clothes: Clothes,
    ) -> &mut Self {
        let instance = self.instances.len();
        self.instances.push(Instance {
            label: Some("person"),
            motion: Motion::Moves,
            scene_from_thing: Pose3::IDENTITY,
        });
        self.people.push(Person { action, scene_from_room, height, clothes, instance });
        self
    }
}
