//! Furniture that stands on the floor. Fronts face -y of the thing's frame; somebody who sits on a chair
//! faces +y.

use std::f32::consts::{FRAC_PI_2, TAU};

use parry3d::math::{Rot3, Vec2, Vec3};

use super::Material;
use super::builder::Builder;
use super::palette::{
    BEECH, BLACK, CABINET, CARDBOARD, CLAY, CONCRETE, CUSHION, LEAVES, PLUSH, STEEL, WHITE,
};
use super::person::Seat;

/// Height of a swivel chair's seat at its highest setting, metres.
pub(super) const SEAT: f32 = 0.51;

/// A swivel chair on five legs with armrests, its seat's top at height `seat`.
pub(super) fn swivel_chair(b: &mut Builder, [x, y]: [f32; 2], yaw: f32, seat: f32) {
    let lowered = SEAT - seat;
    b.thing(Some("chair"), [x, y, 0.0], yaw);
    for k in 0_u8..5 {
        let (sin, cos) = (f32::from(k) * TAU / 5.0).sin_cos();
        b.rod([0.0, 0.0, 0.09], [0.27 * cos, 0.27 * sin, 0.06], 0.022, BLACK);
    }
    b.cylinder([0.0, 0.0, 0.08], 0.36 - lowered, 0.028, STEEL)
        .cuboid([0.0, 0.0, 0.47 - lowered], [0.46, 0.45, 0.08], CUSHION)
        .cuboid([0.0, -0.25, 0.56 - lowered], [0.07, 0.03, 0.24], BLACK)
        .tilted([0.0, -0.26, 0.80 - lowered], [0.42, 0.06, 0.46], 0.12, CUSHION);
    for x in [-0.26, 0.26] {
        b.cuboid([x, 0.02, 0.56 - lowered], [0.03, 0.04, 0.20], BLACK).cuboid(
            [x, 0.03, 0.67 - lowered],
            [0.05, 0.26, 0.03],
            BLACK,
        );
    }
}

/// The seat of a chair that stands at (`x`, `y`), turned by `yaw`: a little behind the chair's middle.
pub(super) fn seat([x, y]: [f32; 2], yaw: f32, phase: f64) -> Seat {
    let hips = Rot3::from_rotation_z(yaw) * Vec3::new(0.0, -0.04, 0.0);
    Seat { position: Vec2::new(x + hips.x, y + hips.y), heading: yaw + FRAC_PI_2, phase, types: false }
}

/// A cabinet of 0.8 x 0.42 x 1.1 m with three drawers.
pub(super) fn cabinet(b: &mut Builder, [x, y]: [f32; 2], yaw: f32) {
    b.thing(None, [x, y, 0.0], yaw).cuboid([0.0, 0.0, 0.55], [0.8, 0.42, 1.10], CABINET);
    for z in [0.2, 0.55, 0.9] {
        b.cuboid([0.0, -0.215, z], [0.74, 0.02, 0.31], STEEL).cuboid(
            [0.0, -0.235, z + 0.08],
            [0.14, 0.02, 0.02],
            BLACK,
        );
    }
}

/// An open shelf of 1.23 x 0.34 x 1.8 m with four boards, their tops at 0.115, 0.615, 1.115 and 1.615 m.
pub(super) fn shelf(b: &mut Builder, [x, y]: [f32; 2], yaw: f32) {
    b.thing(None, [x, y, 0.0], yaw);
    for x in [-0.6, 0.6] {
        b.cuboid([x, 0.0, 0.9], [0.03, 0.34, 1.8], BEECH);
    }
    for z in [0.1, 0.6, 1.1, 1.6] {
        b.cuboid([0.0, 0.0, z], [1.2, 0.34, 0.03], BEECH);
    }
}

/// A plant 1.3 m high in a pot.
pub(super) fn plant(b: &mut Builder, [x, y]: [f32; 2], yaw: f32) {
    b.thing(Some("potted plant"), [x, y, 0.0], yaw).cylinder([0.0; 3], 0.32, 0.17, CLAY).rod(
        [0.0, 0.0, 0.3],
        [0.02, 0.0, 0.8],
        0.02,
        PLUSH,
    );
    for k in 0_u8..7 {
        let angle = f32::from(k) * 2.4;
        let (sin, cos) = angle.sin_cos();
        let height = 0.65 + 0.09 * f32::from(k);
        b.ellipsoid([0.16 * cos, 0.16 * sin, height], [0.14, 0.10, 0.09], LEAVES);
    }
}

/// A table on four legs; its top has the full lengths `size` and the given `height`.
pub(super) fn table(
    b: &mut Builder,
    [x, y]: [f32; 2],
    yaw: f32,
    size: [f32; 2],
    height: f32,
    material: Material,
) {
    const THICKNESS: f32 = 0.035;
    let under = height - THICKNESS;
    b.thing(None, [x, y, 0.0], yaw).cuboid(
        [0.0, 0.0, height - 0.5 * THICKNESS],
        [size[0], size[1], THICKNESS],
        material,
    );
    for (side, end) in [(-0.5, -0.5), (-0.5, 0.5), (0.5, -0.5), (0.5, 0.5)] {
        let foot = [side * (size[0] - 0.12), end * (size[1] - 0.12), 0.5 * under];
        b.cuboid(foot, [0.05, 0.05, under], STEEL);
    }
}

/// A wooden chair of 0.42 x 0.44 x 0.86 m on four legs.
pub(super) fn wooden_chair(b: &mut Builder, [x, y]: [f32; 2], yaw: f32, material: Material) {
    b.thing(Some("chair"), [x, y, 0.0], yaw).cuboid([0.0, 0.0, 0.445], [0.42, 0.42, 0.03], material);
    for side in [-0.185, 0.185] {
        b.cuboid([side, 0.18, 0.215], [0.04, 0.04, 0.43], material);
        b.cuboid([side, -0.195, 0.43], [0.04, 0.04, 0.86], material);
    }
    for z in [0.58, 0.70, 0.82] {
        b.cuboid([0.0, -0.195, z], [0.33, 0.02, 0.06], material);
    }
}

/// A partition 1.4 m high on two feet 0.4 m long.
pub(super) fn partition(b: &mut Builder, [x, y]: [f32; 2], yaw: f32, width: f32, material: Material) {
    b.thing(None, [x, y, 0.0], yaw).cuboid([0.0, 0.0, 0.72], [width, 0.05, 1.36], material);
    for side in [-0.35, 0.35] {
        b.cuboid([side * width, 0.0, 0.02], [0.05, 0.40, 0.04], STEEL);
    }
}

/// A square pillar from the floor to the ceiling.
pub(super) fn pillar(b: &mut Builder, [x, y]: [f32; 2], yaw: f32, width: f32, height: f32) {
    b.thing(None, [x, y, 0.0], yaw).cuboid([0.0, 0.0, 0.5 * height], [width, width, height], CONCRETE);
}

/// A round pillar from the floor to the ceiling.
pub(super) fn round_pillar(b: &mut Builder, [x, y]: [f32; 2], radius: f32, height: f32) {
    b.thing(None, [x, y, 0.0], 0.0).cylinder([0.0; 3], height, radius, CONCRETE);
}

/// Two steps of 17 cm, 0.9 m wide and 0.7 m deep.
pub(super) fn steps(b: &mut Builder, [x, y]: [f32; 2], yaw: f32) {
    b.thing(None, [x, y, 0.0], yaw).cuboid([0.0, 0.0, 0.085], [0.9, 0.7, 0.17], BEECH).cuboid(
        [0.0, 0.17, 0.255],
        [0.9, 0.36, 0.17],
        BEECH,
    );
}

/// Two boxes of cardboard, one on the other.
pub(super) fn boxes(b: &mut Builder, [x, y]: [f32; 2], yaw: f32) {
    b.thing(None, [x, y, 0.0], yaw).cuboid([0.0, 0.0, 0.18], [0.56, 0.42, 0.36], CARDBOARD);
    b.thing(None, [x, y, 0.36], yaw + 0.3).cuboid([0.0, 0.0, 0.13], [0.36, 0.28, 0.26], CARDBOARD);
}

/// A trolley of 0.72 x 0.44 m with boxes on it; its front looks along +x.
pub(super) fn trolley(b: &mut Builder, [x, y]: [f32; 2], yaw: f32) {
    b.thing(None, [x, y, 0.0], yaw).cuboid([0.0, 0.0, 0.22], [0.70, 0.44, 0.04], STEEL);
    for (x, y) in [(-0.28, -0.18), (-0.28, 0.18), (0.28, -0.18), (0.28, 0.18)] {
        b.ellipsoid([x, y, 0.10], [0.09, 0.03, 0.09], BLACK);
    }
    b.cuboid([0.08, 0.0, 0.40], [0.46, 0.36, 0.32], CARDBOARD)
        .cuboid([0.06, 0.02, 0.67], [0.30, 0.28, 0.22], CARDBOARD)
        .rod([-0.34, -0.20, 0.22], [-0.36, -0.20, 0.95], 0.018, STEEL)
        .rod([-0.34, 0.20, 0.22], [-0.36, 0.20, 0.95], 0.018, STEEL)
        .rod([-0.36, -0.20, 0.95], [-0.36, 0.20, 0.95], 0.02, BLACK);
}

/// A refrigerator of 0.6 x 0.62 x 1.7 m.
pub(super) fn refrigerator(b: &mut Builder, [x, y]: [f32; 2], yaw: f32) {
    b.thing(Some("refrigerator"), [x, y, 0.0], yaw).cuboid([0.0, 0.0, 0.85], [0.60, 0.58, 1.70], WHITE);
    for (z, length) in [(0.62, 0.4), (1.38, 0.3)] {
        b.cuboid([-0.24, -0.30, z], [0.03, 0.02, length], STEEL);
    }
}

/// A couch of 1.5 x 0.8 x 0.8 m, its back towards +y.
pub(super) fn couch(b: &mut Builder, [x, y]: [f32; 2], yaw: f32, material: Material) {
    b.thing(Some("couch"), [x, y, 0.0], yaw).cuboid([0.0, 0.0, 0.21], [1.5, 0.8, 0.42], material).cuboid(
        [0.0, 0.31, 0.61],
        [1.5, 0.18, 0.38],
        material,
    );
    for side in [-0.67, 0.67] {
        b.cuboid([side, -0.09, 0.52], [0.16, 0.62, 0.20], material);
    }
}
