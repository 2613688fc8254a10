//! Small things with a label of COCO, standing on what `place` is a point of.

use super::builder::Builder;
use super::palette::{BLACK, CHINA, CLAY, GLASS, KEYS, PLUSH, SCREEN, SPINES};

/// A monitor of 24 inches on its foot.
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

/// A tight row of standing books of full lengths `size`, its centre at `[along, up]` from `place`.
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
