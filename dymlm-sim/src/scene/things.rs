//! Small things with COCO labels; each stands on the point `place` of a surface.

use super::builder::Builder;
use super::palette::{
    ALUMINIUM, BLACK, CHINA, CLAY, GLASS, KEYS, LEATHER, LEAVES, PEEL, PLUSH, SCREEN, SPINES, STEEL,
    TERRACOTTA, TWEED, WHITE,
};

/// A 24-inch monitor on its foot.
pub(super) fn monitor(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("tv"), place, yaw)
        .cuboid([0.0, 0.0, 0.01], [0.24, 0.18, 0.02], BLACK)
        .cuboid([0.0, 0.05, 0.12], [0.06, 0.03, 0.22], BLACK)
        .cuboid([0.0, 0.02, 0.31], [0.54, 0.04, 0.33], BLACK)
        .cuboid([0.0, -0.002, 0.31], [0.51, 0.012, 0.30], SCREEN);
}

pub(super) fn keyboard(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("keyboard"), place, yaw).cuboid([0.0, 0.0, 0.012], [0.44, 0.14, 0.024], KEYS);
}

pub(super) fn mouse(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("mouse"), place, yaw).ellipsoid([0.0, 0.0, 0.015], [0.033, 0.055, 0.022], BLACK);
}

/// Two books, one on the other.
pub(super) fn two_books(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("book"), place, yaw).cuboid([0.0, 0.0, 0.015], [0.17, 0.24, 0.03], SPINES).cuboid(
        [0.01, 0.01, 0.045],
        [0.15, 0.21, 0.03],
        CLAY,
    );
}

/// A tight row of standing books; the row has the full lengths `size` and its centre at `[along, up]` from
/// `place`.
pub(super) fn row_of_books(
    b: &mut Builder,
    place: [f32; 3],
    yaw: f32,
    [along, up]: [f32; 2],
    size: [f32; 3],
) {
    b.thing(Some("book"), place, yaw).cuboid([along, 0.0, up], size, SPINES);
}

pub(super) fn bottle(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("bottle"), place, yaw).cylinder([0.0; 3], 0.17, 0.036, GLASS).cylinder(
        [0.0, 0.0, 0.17],
        0.08,
        0.016,
        GLASS,
    );
}

pub(super) fn cup(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("cup"), place, yaw).cylinder([0.0; 3], 0.095, 0.04, CHINA).rod(
        [0.045, 0.0, 0.03],
        [0.055, 0.0, 0.07],
        0.008,
        CHINA,
    );
}

pub(super) fn teddy_bear(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("teddy bear"), place, yaw)
        .ellipsoid([0.0, 0.0, 0.10], [0.085, 0.075, 0.10], PLUSH)
        .ellipsoid([0.0, -0.01, 0.235], [0.065, 0.06, 0.06], PLUSH)
        .ellipsoid([-0.05, 0.0, 0.29], [0.025, 0.015, 0.025], PLUSH)
        .ellipsoid([0.05, 0.0, 0.29], [0.025, 0.015, 0.025], PLUSH)
        .rod([-0.08, -0.03, 0.15], [-0.12, -0.09, 0.08], 0.028, PLUSH)
        .rod([0.08, -0.03, 0.15], [0.12, -0.09, 0.08], 0.028, PLUSH)
        .rod([-0.05, -0.05, 0.035], [-0.09, -0.13, 0.035], 0.033, PLUSH)
        .rod([0.05, -0.05, 0.035], [0.09, -0.13, 0.035], 0.033, PLUSH);
}

/// A closed book of 16 x 23 x 4 cm.
pub(super) fn book(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("book"), place, yaw).cuboid([0.0, 0.0, 0.02], [0.16, 0.23, 0.04], SPINES);
}

/// An open 14-inch laptop, its screen tilted back.
pub(super) fn laptop(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("laptop"), place, yaw)
        .cuboid([0.0, 0.0, 0.008], [0.32, 0.22, 0.016], ALUMINIUM)
        .cuboid([0.0, -0.01, 0.017], [0.28, 0.12, 0.004], KEYS)
        .tilted([0.0, 0.143, 0.118], [0.32, 0.008, 0.215], -0.3, ALUMINIUM)
        .tilted([0.0, 0.138, 0.118], [0.30, 0.006, 0.195], -0.3, SCREEN);
}

/// A bowl 17 cm wide, filled.
pub(super) fn bowl(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("bowl"), place, yaw)
        .cylinder([0.0; 3], 0.015, 0.04, CHINA)
        .cylinder([0.0, 0.0, 0.015], 0.02, 0.065, CHINA)
        .cylinder([0.0, 0.0, 0.035], 0.035, 0.085, CHINA);
}

pub(super) fn vase(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("vase"), place, yaw)
        .cylinder([0.0; 3], 0.02, 0.05, TERRACOTTA)
        .ellipsoid([0.0, 0.0, 0.11], [0.08, 0.08, 0.11], TERRACOTTA)
        .cylinder([0.0, 0.0, 0.20], 0.06, 0.035, TERRACOTTA);
}

/// A plant 0.3 m high in a pot.
pub(super) fn small_plant(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("potted plant"), place, yaw)
        .cylinder([0.0; 3], 0.11, 0.065, CLAY)
        .ellipsoid([0.0, 0.0, 0.19], [0.10, 0.09, 0.09], LEAVES)
        .ellipsoid([0.03, 0.02, 0.26], [0.06, 0.07, 0.06], LEAVES);
}

pub(super) fn orange(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("orange"), place, yaw).ellipsoid([0.0, 0.0, 0.038], [0.04, 0.04, 0.038], PEEL);
}

/// A microwave oven of 0.46 x 0.34 x 0.27 m.
pub(super) fn microwave(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("microwave"), place, yaw)
        .cuboid([0.0, 0.0, 0.135], [0.46, 0.32, 0.27], STEEL)
        .cuboid([-0.06, -0.165, 0.135], [0.30, 0.01, 0.21], BLACK.absorbing(0.3))
        .cuboid([0.16, -0.165, 0.135], [0.09, 0.01, 0.21], WHITE);
}

/// A suitcase of 0.45 x 0.24 x 0.66 m, upright.
pub(super) fn suitcase(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("suitcase"), place, yaw).cuboid([0.0, 0.0, 0.30], [0.45, 0.24, 0.60], TWEED).cuboid(
        [0.0, 0.0, 0.63],
        [0.14, 0.03, 0.06],
        BLACK,
    );
}

/// A football.
pub(super) fn ball(b: &mut Builder, place: [f32; 3], yaw: f32) {
    b.thing(Some("sports ball"), place, yaw).ellipsoid([0.0, 0.0, 0.11], [0.11, 0.11, 0.11], LEATHER);
}
