//! Projected shapes against what a ray caster sees of them.
use dymlm_core::{BoundingBox, PinholeCamera, Pose};
use dymlm_geometry::OrientedBox;
use dymlm_objects::{DualQuadric, ObjectShape, ShapeKind};
use proptest::prelude::*;

fn camera() -> PinholeCamera {
    PinholeCamera::new(320, 240, 260.0, 255.0, 158.3, 121.7).unwrap()
}

fn pose(translation: [f64; 3], axis: [f64; 3], angle: f64) -> Pose {
    let length = axis.iter().map(|c| c * c).sum::<f64>().sqrt().max(1e-9);
    let (sin, cos) = (0.5 * angle).sin_cos();
    let [x, y, z] = axis.map(|c| sin * c / length);
    let norm = (x * x + y * y + z * z + cos * cos).sqrt();
    Pose::new(translation, [x, y, z, cos].map(|q| q / norm)).unwrap()
}

/// Bounds of the pixels (by fifths) whose rays meet a shape, in pixels, and their number of fifths squared.
fn rasterized(
    own: &OrientedBox,
    kind: ShapeKind,
    world_from_camera: &Pose,
) -> Option<([f64; 4], Vec<[f64; 2]>)> {
    const FINE: f64 = 5.0;
    let box_from_camera = own.world_from_box().inverse() * *world_from_camera;
    let origin = box_from_camera.translation();
    let half = own.lengths().map(|length| 0.5 * length);
    let meets = |pixel: [f64; 2]| {
        let ray = box_from_camera.rotate(camera().back_project(pixel, 1.0));
        match kind {
            ShapeKind::Ellipsoid => {
                let dot =
                    |a: [f64; 3], b: [f64; 3]| (0..3).map(|k| a[k] * b[k] / (half[k] * half[k])).sum::<f64>();
                let (a, b, c) = (dot(ray, ray), dot(origin, ray), dot(origin, origin) - 1.0);
                b * b >= a * c && b < 0.0
            }
            ShapeKind::Cuboid => {
                let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
                for axis in 0..3 {
                    let [a, b] = [-half[axis], half[axis]].map(|side| (side - origin[axis]) / ray[axis]);
                    enter = enter.max(a.min(b));
                    leave = leave.min(a.max(b));
                }
                enter <= leave
            }
        }
    };
    let mut bounds = [f64::INFINITY, f64::INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY];
    let mut seen = Vec::new();
    for row in 0..(240.0 * FINE) as usize {
        for column in 0..(320.0 * FINE) as usize {
            let pixel = [column as f64 / FINE, row as f64 / FINE];
            if meets(pixel) {
                bounds = [
                    bounds[0].min(pixel[0]),
                    bounds[1].min(pixel[1]),
                    bounds[2].max(pixel[0]),
                    bounds[3].max(pixel[1]),
                ];
                if column % 10 == 0 && row % 10 == 0 {
                    seen.push(pixel);
                }
            }
        }
    }
    (bounds[0] <= bounds[2]).then_some((bounds, seen))
}

fn sides(own: &BoundingBox) -> [f64; 4] {
    [own.x_min(), own.y_min(), own.x_max(), own.y_max()].map(f64::from)
}

/// Whether a box lies within the image with room to spare, so that nothing of the raster is cut.
fn is_inside(own: &BoundingBox) -> bool {
    let [left, top, right, bottom] = sides(own);
    left > 1.0 && top > 1.0 && right < 318.0 && bottom < 238.0 && right - left > 4.0 && bottom - top > 4.0
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn a_projection_bounds_what_rays_meet(
        center in prop::array::uniform3(-0.4..0.4_f64),
        depth in 1.5..4.0_f64,
        lengths in prop::array::uniform3(0.1..0.9_f64),
        axis in prop::array::uniform3(-1.0..1.0_f64),
        angle in 0.0..3.1_f64,
    ) {
        let world_from_camera = pose([0.3, -0.2, 0.1], [0.2, 1.0, -0.4], 0.3);
        let in_camera = pose([center[0], center[1], depth], axis, angle);
        let own = OrientedBox::new(world_from_camera * in_camera, lengths).unwrap();
        for kind in [ShapeKind::Cuboid, ShapeKind::Ellipsoid] {
            let image_box = ObjectShape::new(kind, own).image_box(&camera(), &world_from_camera).unwrap();
            if !is_inside(&image_box) {
                continue;
            }
            let (bounds, _) = rasterized(&own, kind, &world_from_camera).unwrap();
            for (own, seen) in sides(&image_box).into_iter().zip(bounds) {
                // A raster of fifths, and corners as narrow as a fifth.
                prop_assert!((own - seen).abs() < 1.0, "{kind:?}: {own} and {seen}");
            }
        }
    }

    #[test]
    fn an_ellipse_holds_just_what_rays_meet(
        depth in 1.0..3.0_f64,
        lengths in prop::array::uniform3(0.1..0.6_f64),
        axis in prop::array::uniform3(-1.0..1.0_f64),
        angle in 0.0..3.1_f64,
    ) {
        let own = OrientedBox::new(pose([0.05, -0.03, depth], axis, angle), lengths).unwrap();
        let quadric = DualQuadric::new(&own);
        let outline = quadric.project(&camera(), &Pose::identity()).unwrap();
        if let Some((_, seen)) = rasterized(&own, ShapeKind::Ellipsoid, &Pose::identity()) {
            prop_assert!(seen.iter().all(|pixel| outline.contains(*pixel)));
        }
        // The rays of the outline touch the ellipsoid: as tangent planes through the camera they satisfy p^T
        // Q p = 0.
        let matrix = quadric.matrix();
        let points: Vec<[f64; 2]> = outline.outline(64).collect();
        for (k, point) in points.iter().enumerate() {
            let next = points[(k + 1) % points.len()];
            let before = points[(k + points.len() - 1) % points.len()];
            let tangent = [next[0] - before[0], next[1] - before[1]];
            let (a, b) = (
                camera().back_project(*point, 1.0),
                camera().back_project([point[0] + tangent[0], point[1] + tangent[1]], 1.0),
            );
            let normal = [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
            let length = normal.iter().map(|c| c * c).sum::<f64>().sqrt();
            let plane = [normal[0] / length, normal[1] / length, normal[2] / length, 0.0];
            let residual: f64 =
                (0..4).map(|i| (0..4).map(|j| plane[i] * matrix[i][j] * plane[j]).sum::<f64>()).sum();
            prop_assert!(residual.abs() < 1e-8, "{residual}");
        }
    }
}

#[test]
fn what_is_behind_the_camera_has_no_outline() {
    let behind = OrientedBox::new(pose([0.0, 0.0, -2.0], [1.0, 0.0, 0.0], 0.0), [0.5; 3]).unwrap();
    let around = OrientedBox::new(Pose::identity(), [2.0; 3]).unwrap();
    for kind in [ShapeKind::Cuboid, ShapeKind::Ellipsoid] {
        assert_eq!(ObjectShape::new(kind, behind).image_box(&camera(), &Pose::identity()), None);
        // The camera is within: whatever is before it fills the image.
        let filling = ObjectShape::new(kind, around).image_box(&camera(), &Pose::identity()).unwrap();
        assert!(filling.x_min() < 0.0 && filling.x_max() > 320.0);
    }
    assert_eq!(DualQuadric::new(&around).project(&camera(), &Pose::identity()), None);
}

#[test]
fn flat_things_have_outlines_too() {
    let flat = OrientedBox::new(pose([0.0, 0.0, 2.0], [1.0, 0.0, 0.0], 0.8), [0.4, 0.3, 0.0]).unwrap();
    for kind in [ShapeKind::Cuboid, ShapeKind::Ellipsoid] {
        let image_box = ObjectShape::new(kind, flat).image_box(&camera(), &Pose::identity()).unwrap();
        assert!(image_box.width() > 40.0 && image_box.height() > 10.0, "{image_box:?}");
    }
}
