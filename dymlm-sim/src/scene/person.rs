use std::f32::consts::TAU;
use std::f64::consts::TAU as TAU_64;

use parry3d::math::{Pose3, Rot3, Vec2, Vec3};

use super::shape::capsule_between;
use super::walk::{Step, Walk};
use super::{Material, Part, Shape};

/// Somebody who walks or sits: an articulated body of eighteen capsules and ellipsoids. The arms and legs of
/// a walker swing in step with the distance walked; somebody who sits gestures, leans and turns the head.
/// Proportions after Drillis and Contini (1966): hip at 0.53, shoulder at 0.82 of the height.
#[derive(Debug, Clone)]
pub(crate) struct Person {
    pub(super) action: Action,
    /// Pose of the room in whose frame the action is given.
    pub(super) scene_from_room: Pose3,
    /// Height, metres.
    pub(super) height: f32,
    pub(super) clothes: Clothes,
    pub(crate) instance: usize,
}

#[derive(Debug, Clone)]
pub(super) enum Action {
    Walks(Walk),
    Sits(Seat),
}

/// A place to sit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Seat {
    /// The point of the floor below the hips.
    pub(super) position: Vec2,
    /// Where the person faces, radians from x.
    pub(super) heading: f32,
    /// Phase of the gestures, 0..1, so that people gesture at different times.
    pub(super) phase: f64,
    /// Whether the hands stay above a desk.
    pub(super) types: bool,
}

#[derive(Debug, Clone, Copy)]
pub(super) struct Clothes {
    pub(super) shirt: Material,
    pub(super) trousers: Material,
    pub(super) skin: Material,
    pub(super) hair: Material,
    pub(super) shoes: Material,
}

/// Length of two steps, metres, for a person of 1.72 m.
const STRIDE: f32 = 1.35;
/// Height of the person whose lengths are given in this file, metres.
const HEIGHT: f32 = 1.72;
/// Height of the hip joints, metres.
const HIP: f32 = 0.93;
/// Height of the seat on which that person sits with feet flat on the floor, metres.
const SEAT: f32 = 0.44;

#[derive(Debug, Clone, Copy)]
enum Side {
    Left,
    Right,
}

impl Side {
    /// Sign of the side's y coordinate: 1 or -1.
    fn sign(self) -> f32 {
        match self {
            Self::Left => 1.0,
            Self::Right => -1.0,
        }
    }
}

impl Person {
    /// Height of the seat on which a person of this height sits with feet flat on the floor, metres.
    pub(super) fn seat_height(height: f32) -> f32 {
        SEAT * height / HEIGHT
    }

    /// Adds the body's parts at `time` seconds.
    pub(super) fn pose(&self, time: f64, parts: &mut Vec<Part>) {
        match &self.action {
            Action::Walks(walk) => self.walking(walk.at(time), parts),
            Action::Sits(seat) => self.sitting(seat, time, parts),
        }
    }

    fn walking(&self, step: Step, parts: &mut Vec<Part>) {
        let size = self.height / HEIGHT;
        let phase = (step.distance / f64::from(STRIDE * size)).fract() as f32 * TAU;
        let in_room = Pose3::from_parts(
            Vec3::new(step.position.x, step.position.y, 0.0),
            Rot3::from_rotation_z(step.heading),
        );
        let root = self.scene_from_room * in_room;
        let mut body = Body { parts, root, size, instance: self.instance };
        // The trunk is highest when the legs pass each other.
        let lift = Vec3::new(0.0, 0.0, 0.02 * (2.0 * phase).cos() - 0.02);
        trunk(&mut body, lift, &self.clothes);
        head(&mut body, lift, &self.clothes);
        for side in [Side::Left, Side::Right] {
            leg(&mut body, lift, phase, side, &self.clothes);
            arm(&mut body, lift, phase, side, &self.clothes);
        }
    }

    fn sitting(&self, seat: &Seat, time: f64, parts: &mut Vec<Part>) {
        let size = self.height / HEIGHT;
        let wave = |period: f64, phase: f64| (TAU_64 * (time / period + phase + seat.phase)).sin() as f32;
        let in_room = Pose3::from_parts(
            Vec3::new(seat.position.x, seat.position.y, 0.0),
            Rot3::from_rotation_z(seat.heading),
        );
        let root = self.scene_from_room * in_room;
        let mut body = Body { parts, root, size, instance: self.instance };
        let lift = Vec3::new(0.0, 0.0, SEAT + 0.10 - HIP);
        for side in [Side::Left, Side::Right] {
            seated_leg(&mut body, lift, 0.02 * wave(4.1, side.sign().into()), side, &self.clothes);
        }

        // The person leans forward from the hips and turns the shoulders.
        let hips = (lift + Vec3::new(0.0, 0.0, HIP)) * size;
        let lean = Rot3::from_rotation_z(0.10 * wave(6.3, 0.2))
            * Rot3::from_rotation_y(0.06 + 0.05 * wave(5.1, 0.6));
        body.root = root * turned_about(hips, lean);
        trunk(&mut body, lift, &self.clothes);
        for side in [Side::Left, Side::Right] {
            let raised = 0.5 + 0.5 * wave(3.4, 0.3 * f64::from(side.sign()));
            let swing = wave(2.3, 0.2 * f64::from(side.sign()));
            let gesture = if seat.types {
                [0.62 + 0.03 * swing, 0.46 + 0.05 * raised]
            } else {
                [0.30 + 0.18 * swing, raised * raised]
            };
            gesturing_arm(&mut body, lift, gesture, side, &self.clothes);
        }

        let neck = (lift + Vec3::new(0.0, 0.0, 1.44)) * size;
        let turn = Rot3::from_rotation_z(0.6 * wave(7.0, 0.4)) * Rot3::from_rotation_y(0.12 * wave(3.1, 0.1));
        body.root *= turned_about(neck, turn);
        head(&mut body, lift, &self.clothes);
    }
}

/// A rotation about `point`, which stays where it is.
fn turned_about(point: Vec3, turn: Rot3) -> Pose3 {
    Pose3::from_parts(point - turn * point, turn)
}

/// A person's body that is being built. Its frame: origin on the floor below the hips, x forward, y left, z
/// up.
struct Body<'a> {
    parts: &'a mut Vec<Part>,
    root: Pose3,
    size: f32,
    instance: usize,
}

impl Body<'_> {
    fn ellipsoid(&mut self, center: Vec3, radii: [f32; 3], material: Material) {
        let pose = Pose3::from_translation(center * self.size);
        self.add(Shape::Ellipsoid(Vec3::from(radii) * self.size), pose, material);
    }

    fn limb(&mut self, a: Vec3, b: Vec3, radius: f32, material: Material) {
        let (shape, pose) = capsule_between(a * self.size, b * self.size, radius * self.size);
        self.add(shape, pose, material);
    }

    fn add(&mut self, shape: Shape, body_from_part: Pose3, material: Material) {
        let scene_from_part = self.root * body_from_part;
        self.parts.push(Part { shape, scene_from_part, material, instance: self.instance });
    }
}

fn trunk(body: &mut Body<'_>, lift: Vec3, clothes: &Clothes) {
    body.ellipsoid(lift + Vec3::new(0.0, 0.0, 0.97), [0.125, 0.175, 0.14], clothes.trousers);
    body.ellipsoid(lift + Vec3::new(0.0, 0.0, 1.21), [0.13, 0.185, 0.29], clothes.shirt);
    body.limb(lift + Vec3::new(0.0, -0.15, 1.40), lift + Vec3::new(0.0, 0.15, 1.40), 0.07, clothes.shirt);
}

fn head(body: &mut Body<'_>, lift: Vec3, clothes: &Clothes) {
    body.limb(lift + Vec3::new(0.0, 0.0, 1.44), lift + Vec3::new(0.02, 0.0, 1.54), 0.055, clothes.skin);
    body.ellipsoid(lift + Vec3::new(0.03, 0.0, 1.61), [0.1, 0.075, 0.115], clothes.skin);
    body.ellipsoid(lift + Vec3::new(0.01, 0.0, 1.645), [0.1, 0.082, 0.1], clothes.hair);
}

/// Hip and knee follow the walking phase: the leg swings by 25 degrees to both sides, and the knee bends
/// while it comes forward.
fn leg(body: &mut Body<'_>, lift: Vec3, phase: f32, side: Side, clothes: &Clothes) {
    let (y, phase) = on(side, 0.09, phase);
    let swing = 0.43 * phase.sin();
    let knee_bend = 0.12 + 0.85 * phase.cos().max(0.0).powi(2);
    let hip = lift + Vec3::new(0.0, y, 0.93);
    let knee = hip + 0.43 * hanging(swing + 0.06);
    let ankle = knee + 0.41 * hanging(swing + 0.06 - knee_bend);
    body.limb(hip, knee, 0.075, clothes.trousers);
    body.limb(knee, ankle, 0.052, clothes.trousers);
    // The foot turns by half the angle of the shank; the ankle makes up for the other half.
    let forward = Vec3::Y.cross(hanging(0.5 * (swing - knee_bend))) * -1.0;
    body.limb(ankle - 0.04 * forward, ankle + 0.15 * forward, 0.045, clothes.shoes);
}

/// Each arm swings against the leg of its side, with the elbow a little bent.
fn arm(body: &mut Body<'_>, lift: Vec3, phase: f32, side: Side, clothes: &Clothes) {
    let (y, phase) = on(side, 0.215, phase);
    let swing = -0.38 * phase.sin();
    let shoulder = lift + Vec3::new(0.0, y, 1.39);
    let elbow = shoulder + 0.29 * hanging(swing);
    let wrist = elbow + 0.25 * hanging(swing + 0.35 + 0.15 * phase.sin().min(0.0).abs());
    body.limb(shoulder, elbow, 0.05, clothes.shirt);
    body.limb(elbow, wrist, 0.04, clothes.shirt);
    body.limb(wrist, wrist + 0.08 * (wrist - elbow).normalize_or(Vec3::Z), 0.04, clothes.skin);
}

/// The thigh is along the seat, the shank points down, the foot is flat; `sway` moves the knee to the side.
fn seated_leg(body: &mut Body<'_>, lift: Vec3, sway: f32, side: Side, clothes: &Clothes) {
    let hip = lift + Vec3::new(0.0, 0.09 * side.sign(), HIP);
    let knee = hip + Vec3::new(0.425, 0.04 * side.sign() + sway, -0.04);
    let ankle = knee + 0.41 * hanging(0.08 * side.sign());
    body.limb(hip, knee, 0.075, clothes.trousers);
    body.limb(knee, ankle, 0.052, clothes.trousers);
    body.limb(ankle - 0.04 * Vec3::X, ankle + 0.15 * Vec3::X, 0.045, clothes.shoes);
}

/// The upper arm hangs, swung forward by `swing`; the forearm points forward, up by the share `raised`
/// (0..1), and a little inwards.
fn gesturing_arm(body: &mut Body<'_>, lift: Vec3, [swing, raised]: [f32; 2], side: Side, clothes: &Clothes) {
    let shoulder = lift + Vec3::new(0.0, 0.215 * side.sign(), 1.39);
    let elbow = shoulder + 0.29 * hanging(swing);
    let inwards = Rot3::from_rotation_z(-0.35 * side.sign());
    let forearm = inwards * hanging(1.45 + 1.05 * raised);
    let wrist = elbow + 0.25 * forearm;
    body.limb(shoulder, elbow, 0.05, clothes.shirt);
    body.limb(elbow, wrist, 0.04, clothes.shirt);
    body.limb(wrist, wrist + 0.08 * forearm, 0.04, clothes.skin);
}

/// The offset to the side, and the phase; those of the two sides differ by half a cycle.
fn on(side: Side, y: f32, phase: f32) -> (f32, f32) {
    match side {
        Side::Left => (y, phase),
        Side::Right => (-y, phase + 0.5 * TAU),
    }
}

/// The direction of a limb that hangs down, swung forward by `angle`.
fn hanging(angle: f32) -> Vec3 {
    Vec3::new(angle.sin(), 0.0, -angle.cos())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::material::Pattern;

    fn walker() -> Person {
        let material = Material::new(Pattern::Noise, 0.1, [0.2; 3], [0.5; 3]);
        let clothes =
            Clothes { shirt: material, trousers: material, skin: material, hair: material, shoes: material };
        let walk = Walk::new(&[[-2.0, 0.0], [2.0, -0.5], [2.0, 0.5]], 0.8, 0.0);
        Person {
            action: Action::Walks(walk),
            scene_from_room: Pose3::IDENTITY,
            height: 1.8,
            clothes,
            instance: 5,
        }
    }

    #[test]
    fn stands_on_the_floor_and_is_as_tall_as_said() {
        let person = walker();
        let mut parts = Vec::new();
        for frame in 0..60 {
            parts.clear();
            person.pose(f64::from(frame) * 0.05, &mut parts);
            assert_eq!(parts.len(), 18);
            let mut lowest = f32::INFINITY;
            let mut highest = 0.0_f32;
            for part in &parts {
                let h = part.shape.half_extents();
                for k in 0..2000 {
                    let t = k as f32;
                    let direction = Vec3::new((t * 2.4).sin(), (t * 1.7).cos(), (t * 0.37).sin());
                    let point = h * direction.normalize_or(Vec3::Z) * 1.0;
                    if part.shape.reaches(point, 0.0) {
                        let z = (part.scene_from_part * point).z;
                        lowest = lowest.min(z);
                        highest = highest.max(z);
                    }
                }
            }
            assert!((-0.04..0.10).contains(&lowest), "frame {frame}: lowest point at {lowest}");
            assert!((1.72..1.86).contains(&highest), "frame {frame}: highest point at {highest}");
        }
    }
}
