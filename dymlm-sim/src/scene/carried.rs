use std::f32::consts::TAU;
use std::fmt;

use parry3d::math::{Pose3, Rot3, Vec3};

use super::builder::Builder;
use super::material::Pattern::{Glyphs, Noise};
use super::shape::capsule_between;
use super::{Instance, Material, Motion, Part, Shape, furniture};

/// A thing that a hand carries.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum CarriedKind {
    /// 24 x 17 x 3 cm, lying.
    #[default]
    Book,
    /// 44 x 14 x 2.5 cm.
    Keyboard,
    /// 22 cm high, 7 cm across.
    Bottle,
    /// 10 cm high, 8.4 cm across, with a handle.
    Cup,
    /// 20 x 14 x 12 cm, of cardboard.
    Box,
}

/// How the thing moves on its way: it rests for a second and is then carried for six seconds to another place
/// on the table, always with a final turn of 20 degrees.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub enum CarriedMotion {
    /// Moved to and fro by 15 cm, without tilting.
    #[default]
    Translation,
    /// Tilted towards the camera and away from it.
    RotationX,
    /// Tilted to both sides by 45 degrees.
    RotationY,
    /// Turned to both sides by 57 degrees.
    RotationZ,
    /// Shaken at up to 1 m/s.
    Fast,
    /// Held almost still (3 cm) while another hand comes between it and the camera.
    Occlusion,
}

/// A carried thing and its motion: for testing object trackers.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[non_exhaustive]
pub struct CarriedObject {
    /// The thing. Default [`CarriedKind::Book`].
    pub kind: CarriedKind,
    /// Its motion. Default [`CarriedMotion::Translation`].
    pub motion: CarriedMotion,
}

impl CarriedObject {
    /// A thing and its motion.
    pub fn new(kind: CarriedKind, motion: CarriedMotion) -> Self {
        Self { kind, motion }
    }

    /// Ten combinations for judging trackers: translation, turns about each axis, partial occlusion and fast
    /// motion.
    pub fn ten() -> [Self; 10] {
        [
            Self::new(CarriedKind::Book, CarriedMotion::RotationX),
            Self::new(CarriedKind::Book, CarriedMotion::Translation),
            Self::new(CarriedKind::Book, CarriedMotion::Occlusion),
            Self::new(CarriedKind::Keyboard, CarriedMotion::RotationX),
            Self::new(CarriedKind::Keyboard, CarriedMotion::RotationZ),
            Self::new(CarriedKind::Bottle, CarriedMotion::RotationY),
            Self::new(CarriedKind::Bottle, CarriedMotion::Fast),
            Self::new(CarriedKind::Cup, CarriedMotion::Translation),
            Self::new(CarriedKind::Box, CarriedMotion::RotationZ),
            Self::new(CarriedKind::Box, CarriedMotion::Fast),
        ]
    }
}

/// In two words: "book tilted".
impl fmt::Display for CarriedObject {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let thing = match self.kind {
            CarriedKind::Book => "book",
            CarriedKind::Keyboard => "keyboard",
            CarriedKind::Bottle => "bottle",
            CarriedKind::Cup => "cup",
            CarriedKind::Box => "box",
        };
        let motion = match self.motion {
            CarriedMotion::Translation => "moved",
            CarriedMotion::RotationX => "tilted",
            CarriedMotion::RotationY => "leant",
            CarriedMotion::RotationZ => "turned",
            CarriedMotion::Fast => "shaken",
            CarriedMotion::Occlusion => "covered",
        };
        write!(out, "{thing} {motion}")
    }
}

/// When the thing leaves its first place, and how long it is carried, seconds.
const START: f32 = 1.0;
const DURATION: f32 = 6.0;
/// The small table on which it stands: centre, size, height.
const TABLE: ([f32; 2], [f32; 2], f32) = ([0.07, -0.15], [1.1, 0.5], 0.74);
/// Where the thing is picked up and put down.
const FROM: [f32; 2] = [0.34, -0.20];
const TO: [f32; 2] = [-0.20, -0.10];
/// How high it is lifted, metres.
const LIFT: f32 = 0.18;
/// How far it has turned when it is put down, radians.
const LAST_YAW: f32 = 0.35;
/// The camera's approximate position (the office's viewpoint).
const EYE: Vec3 = Vec3::new(0.15, -1.45, 1.45);

/// The point that the camera looks at: beyond and below the carried thing, as far away as the desk, so that
/// the camera's turns keep their usual angles.
pub(super) const TARGET: Vec3 = Vec3::new(0.0, 1.5, 0.35);

const SKIN: Material = Material::new(Noise, 0.03, [0.72, 0.52, 0.42], [0.86, 0.67, 0.56]);
const SLEEVE: Material = Material::new(Noise, 0.04, [0.18, 0.22, 0.30], [0.34, 0.38, 0.46]);
const COVER: Material = Material::new(Noise, 0.022, [0.12, 0.10, 0.32], [0.95, 0.80, 0.42]);
const PAGES: Material = Material::new(Noise, 0.02, [0.70, 0.68, 0.62], [0.95, 0.93, 0.88]);
const KEYCAPS: Material = Material::new(Glyphs, 0.019, [0.06, 0.06, 0.07], [0.75, 0.75, 0.77]);
const LABEL: Material = Material::new(Noise, 0.016, [0.10, 0.35, 0.20], [0.95, 0.90, 0.55]);
const CAP: Material = Material::new(Noise, 0.02, [0.60, 0.12, 0.10], [0.85, 0.30, 0.25]);
const GLAZE: Material = Material::new(Noise, 0.018, [0.92, 0.92, 0.90], [0.15, 0.25, 0.60]);
const PRINT: Material = Material::new(Noise, 0.025, [0.45, 0.30, 0.16], [0.90, 0.76, 0.55]);

/// A carried thing and the hands.
#[derive(Debug, Clone)]
pub(crate) struct Carried {
    what: CarriedObject,
    pub(crate) instance: usize,
    hand: usize,
}

/// Everything that a carried thing adds to a room.
pub(super) struct CarriedSet {
    pub(super) carried: Carried,
    /// The bodies of the table that the thing stands on.
    pub(super) table: Vec<Part>,
    /// The table, the thing and the hand.
    pub(super) instances: Vec<Instance>,
}

impl CarriedSet {
    /// A small table before the camera's station with a thing that a hand picks up, moves and puts down.
    /// `first` is the number of the first instance.
    pub(super) fn new(what: CarriedObject, first: usize) -> Self {
        let mut table = Builder::default();
        furniture::table(&mut table, TABLE.0, 0.0, TABLE.1, TABLE.2, super::palette::OAK);
        let bodies = table.parts.into_iter();
        let mut instances = table.instances;
        let instance = first + instances.len();
        let mover = |label| Instance { label, motion: Motion::Moves, scene_from_thing: Pose3::IDENTITY };
        instances.extend([mover(Some(what.kind.label())), mover(None)]);
        Self {
            carried: Carried { what, instance, hand: instance + 1 },
            table: bodies.map(|part| Part { instance: first + part.instance, ..part }).collect(),
            instances,
        }
    }
}

impl CarriedKind {
    /// The COCO label; COCO has none for a box, which is called a suitcase.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Book => "book",
            Self::Keyboard => "keyboard",
            Self::Bottle => "bottle",
            Self::Cup => "cup",
            Self::Box => "suitcase",
        }
    }

    /// Full lengths along its own x (to the right), y (away from the camera) and z (upwards), metres.
    pub(crate) fn lengths(self) -> [f32; 3] {
        match self {
            Self::Book => [0.24, 0.17, 0.03],
            Self::Keyboard => [0.44, 0.14, 0.025],
            Self::Bottle => [0.07, 0.07, 0.22],
            Self::Cup => [0.084, 0.084, 0.10],
            Self::Box => [0.20, 0.14, 0.12],
        }
    }
}

impl Carried {
    /// The kind of the thing.
    pub(crate) fn kind(&self) -> CarriedKind {
        self.what.kind
    }

    /// The pose of the thing's frame: origin in the thing's middle; at rest x to the right, y away from the
    /// camera, z up.
    pub(crate) fn scene_from_object(&self, time: f64) -> Pose3 {
        let progress = ((time as f32 - START) / DURATION).clamp(0.0, 1.0);
        let held = smooth(0.0, 0.2, progress) * smooth(1.0, 0.8, progress);
        let along = smooth(0.15, 0.85, progress);
        let half_height = 0.5 * self.what.kind.lengths()[2];
        let place = |[x, y]: [f32; 2]| Vec3::new(x, y, TABLE.2 + half_height);
        let wave = |rounds: f32| (TAU * rounds * progress).sin();
        let mut offset = Vec3::ZERO;
        let mut turn = Vec3::ZERO;
        match self.what.motion {
            CarriedMotion::Translation => {
                offset = Vec3::new(0.15 * wave(2.0), 0.12 * wave(1.0), 0.10 * wave(3.0));
            }
            CarriedMotion::RotationX => {
                turn.x = if progress < 0.5 { 0.7 * wave(1.0) } else { 0.2 * wave(1.0) };
            }
            CarriedMotion::RotationY => turn.y = 0.79 * wave(1.0),
            CarriedMotion::RotationZ => turn.z = wave(1.0),
            CarriedMotion::Fast => offset = Vec3::new(0.13 * wave(6.0), 0.0, 0.07 * wave(9.0)),
            CarriedMotion::Occlusion => offset = Vec3::new(0.03 * wave(2.0), 0.0, 0.02 * wave(3.0)),
        }
        let translation = place(FROM).lerp(place(TO), along) + held * (Vec3::new(0.0, 0.0, LIFT) + offset);
        let rotation = Rot3::from_rotation_z(LAST_YAW * along) * Rot3::from_scaled_axis(held * turn);
        Pose3::from_parts(translation, rotation)
    }

    /// Adds the bodies of the thing and of the hands at `time` seconds, always the same number in the same
    /// order.
    pub(crate) fn pose(&self, time: f64, parts: &mut Vec<Part>) {
        let scene_from_object = self.scene_from_object(time);
        let mut add = |shape: Shape, object_from_part: Pose3, material: Material| {
            let scene_from_part = scene_from_object * object_from_part;
            parts.push(Part { shape, scene_from_part, material, instance: self.instance });
        };
        self.bodies(&mut add);
        self.carrying_hand(time as f32, &scene_from_object, parts);
        if self.what.motion == CarriedMotion::Occlusion {
            self.other_hand(time as f32, &scene_from_object, parts);
        }
    }

    fn bodies(&self, add: &mut impl FnMut(Shape, Pose3, Material)) {
        let lengths = Vec3::from(self.what.kind.lengths());
        let half = 0.5 * lengths;
        let upright = |center: Vec3| Pose3::from_parts(center, Rot3::from_rotation_x(0.25 * TAU));
        match self.what.kind {
            CarriedKind::Book => {
                // Pages between two covers; the spine is on the left.
                let cover = Vec3::new(half.x, half.y, 0.002);
                for side in [-1.0, 1.0] {
                    let center = Vec3::new(0.0, 0.0, side * (half.z - 0.002));
                    add(Shape::cuboid(cover), Pose3::from_translation(center), COVER);
                }
                let spine = Vec3::new(0.002, half.y, half.z);
                add(
                    Shape::cuboid(spine),
                    Pose3::from_translation(Vec3::new(0.002 - half.x, 0.0, 0.0)),
                    COVER,
                );
                let pages = half - Vec3::new(0.005, 0.004, 0.003);
                add(Shape::cuboid(pages), Pose3::IDENTITY, PAGES);
            }
            CarriedKind::Keyboard => add(Shape::cuboid(half), Pose3::IDENTITY, KEYCAPS),
            CarriedKind::Box => add(Shape::cuboid(half), Pose3::IDENTITY, PRINT),
            CarriedKind::Bottle => {
                let body = Shape::cylinder(0.075, half.x);
                add(body, upright(Vec3::new(0.0, 0.0, -0.035)), LABEL);
                add(Shape::cylinder(0.02, 0.026), upright(Vec3::new(0.0, 0.0, 0.06)), LABEL);
                add(Shape::cylinder(0.015, 0.016), upright(Vec3::new(0.0, 0.0, 0.095)), CAP);
            }
            CarriedKind::Cup => {
                add(Shape::cylinder(half.z, half.x), upright(Vec3::ZERO), GLAZE);
                let handle = Vec3::new(0.014, 0.006, 0.028);
                let place = Vec3::new(-half.x - 0.010, 0.0, 0.0);
                add(Shape::cuboid(handle), Pose3::from_translation(place), GLAZE);
            }
        }
    }

    /// Fingers around the thing's right side, a palm, and a forearm that comes from the lower right.
    fn carrying_hand(&self, time: f32, scene_from_object: &Pose3, parts: &mut Vec<Part>) {
        let half = 0.5 * Vec3::from(self.what.kind.lengths());
        let grip =
            smooth(0.2, START - 0.1, time) * smooth(START + DURATION + 0.7, START + DURATION + 0.1, time);
        // The hand comes from the side and leaves to the same side.
        let away = (1.0 - grip) * Vec3::new(0.45, -0.10, 0.12);
        let on_object = |point: Vec3| scene_from_object.transform_point(point) + away;
        let palm = on_object(Vec3::new(half.x + 0.035, -0.01, -0.2 * half.z));
        for (y, reach) in [(-0.03, 0.030), (-0.008, 0.038), (0.014, 0.034)] {
            let tip = on_object(Vec3::new(half.x - reach, y, half.z + 0.010));
            let knuckle = on_object(Vec3::new(half.x + 0.022, y, half.z + 0.004));
            self.limb(knuckle, tip, 0.0085, SKIN, parts);
            self.limb(palm, knuckle, 0.010, SKIN, parts);
        }
        let elbow = palm + Vec3::new(0.26, -0.10, -0.12);
        self.limb(palm, palm.lerp(elbow, 0.2), 0.026, SKIN, parts);
        self.limb(palm.lerp(elbow, 0.2), elbow, 0.040, SLEEVE, parts);
        self.limb(elbow, elbow + Vec3::new(0.2, -0.15, 0.1), 0.050, SLEEVE, parts);
    }

    /// Another hand that comes between the thing and the camera for two seconds.
    fn other_hand(&self, time: f32, scene_from_object: &Pose3, parts: &mut Vec<Part>) {
        let middle = START + 0.55 * DURATION;
        let near = smooth(middle - 1.4, middle - 0.8, time) * smooth(middle + 1.4, middle + 0.8, time);
        let object = scene_from_object.translation;
        let towards_eye = (EYE - object).normalize();
        let aside = (1.0 - near) * Vec3::new(-0.5, 0.0, -0.15);
        let palm = object + 0.16 * towards_eye + Vec3::new(-0.02, 0.0, 0.0) + aside;
        let elbow = palm + Vec3::new(-0.28, -0.06, -0.10);
        for k in 0..4 {
            let across = Vec3::new(0.0, 0.0, 0.021 * (k as f32 - 1.5));
            self.limb(palm + across, palm + across + Vec3::new(0.075, 0.01, 0.01), 0.0095, SKIN, parts);
        }
        self.limb(palm + Vec3::new(-0.02, 0.0, -0.02), palm + Vec3::new(0.0, 0.0, 0.02), 0.035, SKIN, parts);
        self.limb(palm - Vec3::new(0.03, 0.0, 0.0), elbow, 0.038, SLEEVE, parts);
        self.limb(elbow, elbow + Vec3::new(-0.2, -0.2, -0.05), 0.050, SLEEVE, parts);
    }

    fn limb(&self, a: Vec3, b: Vec3, radius: f32, material: Material, parts: &mut Vec<Part>) {
        let (shape, scene_from_part) = capsule_between(a, b, radius);
        parts.push(Part { shape, scene_from_part, material, instance: self.hand });
    }
}

/// Rises smoothly from 0 at `x` = `zero` to 1 at `one`; `one` may also be the smaller of the two.
pub(super) fn smooth(zero: f32, one: f32, x: f32) -> f32 {
    let t = ((x - zero) / (one - zero)).clamp(0.0, 1.0);
    t * t * t * (t * (6.0 * t - 15.0) + 10.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    const KINDS: [CarriedKind; 5] =
        [CarriedKind::Book, CarriedKind::Keyboard, CarriedKind::Bottle, CarriedKind::Cup, CarriedKind::Box];
    const MOTIONS: [CarriedMotion; 6] = [
        CarriedMotion::Translation,
        CarriedMotion::RotationX,
        CarriedMotion::RotationY,
        CarriedMotion::RotationZ,
        CarriedMotion::Fast,
        CarriedMotion::Occlusion,
    ];

    fn carried(kind: CarriedKind, motion: CarriedMotion) -> Carried {
        Carried { what: CarriedObject { kind, motion }, instance: 0, hand: 1 }
    }

    #[test]
    fn stands_on_the_table_and_stays_above_it() {
        for kind in KINDS {
            for motion in MOTIONS {
                let carried = carried(kind, motion);
                let mut parts = Vec::new();
                for step in 0..90 {
                    let time = 0.1 * f64::from(step);
                    parts.clear();
                    carried.pose(time, &mut parts);
                    let own = parts.iter().filter(|part| part.instance == 0);
                    let lowest = own
                        .map(|part| {
                            let h = part.shape.half_extents();
                            let down = (part.scene_from_part.rotation.inverse() * Vec3::Z).abs();
                            part.scene_from_part.translation.z - down.dot(h)
                        })
                        .fold(f32::INFINITY, f32::min);
                    assert!(lowest > TABLE.2 - 1e-3, "{kind:?} {motion:?} at {time}: {lowest}");
                    if !(1.0..7.0).contains(&time) {
                        assert!((lowest - TABLE.2).abs() < 1e-3, "{kind:?} {motion:?} at {time}: {lowest}");
                    }
                }
            }
        }
    }

    #[test]
    fn its_bodies_fill_its_lengths() {
        for kind in KINDS {
            let mut parts = Vec::new();
            carried(kind, CarriedMotion::Translation).pose(0.0, &mut parts);
            let from_scene = carried(kind, CarriedMotion::Translation).scene_from_object(0.0).inverse();
            let (mut low, mut high) = (Vec3::splat(1.0), Vec3::splat(-1.0));
            for part in parts.iter().filter(|part| part.instance == 0) {
                let pose = from_scene * part.scene_from_part;
                let h = part.shape.half_extents();
                let along = |axis: Vec3| (pose.rotation.inverse() * axis).abs().dot(h);
                let reach = Vec3::new(along(Vec3::X), along(Vec3::Y), along(Vec3::Z));
                low = low.min(pose.translation - reach);
                high = high.max(pose.translation + reach);
            }
            let lengths = Vec3::from(kind.lengths());
            // The cup's handle sticks out.
            let slack = if kind == CarriedKind::Cup { 0.03 } else { 1e-4 };
            assert!(((high - low) - lengths).abs().max_element() < slack, "{kind:?}: {low} {high}");
        }
    }

    #[test]
    fn moves_smoothly_and_fast_where_said() {
        for motion in MOTIONS {
            let carried = carried(CarriedKind::Book, motion);
            let fastest = (0..900)
                .map(|i| {
                    let at = |i: i32| carried.scene_from_object(0.01 * f64::from(i)).translation;
                    (at(i + 1) - at(i)).length() / 0.01
                })
                .fold(0.0_f32, f32::max);
            let limits = if motion == CarriedMotion::Fast { 0.8..1.3 } else { 0.1..0.8 };
            assert!(limits.contains(&fastest), "{motion:?}: {fastest} m/s");
        }
    }
}
