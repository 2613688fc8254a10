//! Boxes around points whose box is known.
use dymlm_core::{Plane, Point, Pose};
use dymlm_geometry::OrientedBox;
use dymlm_objects::{BoxAxes, BoxFitter, BoxFitterConfig};
use proptest::prelude::*;

fn fitter(change: impl FnOnce(&mut BoxFitterConfig)) -> BoxFitter {
    let mut config = BoxFitterConfig::default();
    change(&mut config);
    BoxFitter::new(config).unwrap()
}

fn turned(axis: [f64; 3], angle: f64, translation: [f64; 3]) -> Pose {
    let length = axis.iter().map(|c| c * c).sum::<f64>().sqrt();
    let (sin, cos) = (0.5 * angle).sin_cos();
    let [x, y, z] = axis.map(|c| sin * c / length);
    Pose::new(translation, [x, y, z, cos]).unwrap()
}

/// Points all over a box's surface, its corners among them.
fn surface(own: &OrientedBox, steps: usize) -> Vec<Point> {
    let mut points = Vec::new();
    let at = |k: usize| k as f64 / steps as f64 - 0.5;
    for i in 0..=steps {
        for j in 0..=steps {
            for side in [-0.5, 0.5] {
                for place in [[at(i), at(j), side], [at(i), side, at(j)], [side, at(i), at(j)]] {
                    let scaled = [0, 1, 2].map(|axis| place[axis] * own.lengths()[axis]);
                    points.push(own.world_from_box().transform_point(scaled).map(|c| c as f32));
                }
            }
        }
    }
    points
}

proptest! {
    #[test]
    fn a_box_is_found_again(
        axis in prop::array::uniform3(0.1..1.0_f64),
        angle in 0.0..3.0_f64,
        translation in prop::array::uniform3(-5.0..5.0_f64),
        height in 0.05..0.2_f64,
    ) {
        let own = OrientedBox::new(turned(axis, angle, translation), [0.9, 0.5, height]).unwrap();
        let fit = fitter(|_| {}).fit(&surface(&own, 12), None).unwrap();
        prop_assert!(fit.oriented_box.iou(&own) > 0.98, "{:?} for {own:?}", fit.oriented_box);
        let rows = fit.oriented_box.world_from_box().rotation_matrix();
        let determinant = (0..3).map(|k| rows[0][k]
            * (rows[1][(k + 1) % 3] * rows[2][(k + 2) % 3] - rows[1][(k + 2) % 3] * rows[2][(k + 1) % 3])).sum::<f64>();
        prop_assert!((determinant - 1.0).abs() < 1e-9);
    }

    #[test]
    fn a_fit_moves_with_its_points(angle in 0.0..3.0_f64, translation in prop::array::uniform3(-2.0..2.0_f64)) {
        let own = OrientedBox::new(turned([0.3, 0.2, 1.0], 0.4, [0.0; 3]), [0.8, 0.4, 0.1]).unwrap();
        let world_from_here = turned([0.1, 1.0, 0.3], angle, translation);
        let moved = own.transformed(&world_from_here);
        let (here, there) = (
            fitter(|_| {}).fit(&surface(&own, 8), None).unwrap(),
            fitter(|_| {}).fit(&surface(&moved, 8), None).unwrap(),
        );
        prop_assert!(here.oriented_box.transformed(&world_from_here).iou(&there.oriented_box) > 0.99);
    }
}

#[test]
fn the_rectangle_corrects_the_yaw_of_a_square() {
    // Principal axes of a square point anywhere: a few more points in two corners turn them by 45 degrees.
    let own = OrientedBox::new(turned([0.0, 0.0, 1.0], 0.3, [0.0; 3]), [0.5, 0.5, 0.1]).unwrap();
    let mut points = surface(&own, 10);
    for corner in [[0.25, 0.25, 0.05], [-0.25, -0.25, 0.05]] {
        points.extend(vec![own.world_from_box().transform_point(corner).map(|c| c as f32); 60]);
    }
    let corrected = fitter(|_| {}).fit(&points, None).unwrap();
    assert_eq!(corrected.axes, BoxAxes::Rectangle);
    assert!(corrected.oriented_box.iou(&own) > 0.99, "{}", corrected.oriented_box.iou(&own));
}

#[test]
fn a_vertical_makes_up_for_sides_that_are_not_seen() {
    // Front and top only, of a thing on a table.
    let own = OrientedBox::new(Pose::identity(), [0.4, 0.3, 0.2]).unwrap();
    let seen: Vec<Point> =
        surface(&own, 20).into_iter().filter(|point| point[1] < -0.149 || point[2] > 0.099).collect();
    let table = Plane::new([0.0, 0.0, 1.0], 0.1).unwrap();
    let alone = fitter(|_| {}).fit(&seen, None).unwrap();
    let upright = fitter(|_| {}).fit(&seen, Some(table.normal())).unwrap().standing_on(&table, 0.0);
    assert!(alone.oriented_box.iou(&own) < 0.8, "{}", alone.oriented_box.iou(&own));
    assert!(upright.oriented_box.iou(&own) > 0.999);
    assert_eq!(upright.oriented_box.lengths().map(|length| (100.0 * length).round()), [40.0, 30.0, 20.0]);
}

#[test]
fn a_foot_lost_in_the_noise_is_put_back_on_the_plane() {
    let own = OrientedBox::new(Pose::identity(), [0.4, 0.3, 0.2]).unwrap();
    let seen: Vec<Point> = surface(&own, 20).into_iter().filter(|point| point[2] > -0.06).collect();
    let table = Plane::new([0.0, 0.0, 1.0], 0.1).unwrap();
    let fit = fitter(|_| {}).fit(&seen, Some(table.normal())).unwrap();
    assert!(fit.oriented_box.lengths()[2] < 0.165);
    assert!(fit.standing_on(&table, 0.0).oriented_box.iou(&own) > 0.999);
    // Wholly below the plane: nothing stands there.
    let above = Plane::new([0.0, 0.0, 1.0], -0.5).unwrap();
    assert_eq!(fit.standing_on(&above, 0.0), fit);
}

#[test]
fn trimming_leaves_out_what_sticks_out() {
    let own = OrientedBox::new(Pose::identity(), [0.4, 0.3, 0.2]).unwrap();
    let mut points = surface(&own, 20);
    points.push([3.0, 0.0, 0.0]);
    let up = Some([0.0, 0.0, 1.0]);
    let trimmed = fitter(|config| config.trim = 0.01).fit(&points, up).unwrap();
    let all = fitter(|_| {}).fit(&points, up).unwrap();
    assert!(all.oriented_box.lengths()[0] > 3.0 && trimmed.oriented_box.iou(&own) > 0.9);
}

#[test]
fn degenerate_points_are_no_reason_to_panic() {
    let mut fitter = fitter(|config| config.along_edges = true);
    for vertical in [None, Some([0.0, 0.0, 1.0]), Some([0.0; 3]), Some([f64::NAN; 3])] {
        assert_eq!(fitter.fit(&[], vertical), None);
        assert_eq!(fitter.fit(&[[f32::NAN, 0.0, 0.0], [f32::INFINITY, 0.0, 1.0]], vertical), None);
        let point = fitter.fit(&[[1.0, 2.0, 3.0]; 5], vertical).unwrap();
        assert_eq!(point.oriented_box.volume(), 0.0);
        assert_eq!(point.oriented_box.center(), [1.0, 2.0, 3.0]);
        let line: Vec<Point> = (0..9).map(|k| [0.1 * k as f32, 0.0, 0.0]).collect();
        let line = fitter.fit(&line, vertical).unwrap();
        assert!((line.oriented_box.lengths()[0] - 0.8).abs() < 1e-6);
        let mixed =
            [[0.0, 0.0, 0.0], [f32::NAN; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0, 1.0, f32::INFINITY]];
        assert!(fitter.fit(&mixed, vertical).unwrap().oriented_box.lengths().iter().all(|c| c.is_finite()));
        let huge = [[1e30, 0.0, 0.0], [0.0, 1e30, 0.0], [0.0, 0.0, 1e30], [-1e30, 1.0, 2.0]];
        let _ = fitter.fit(&huge, vertical);
    }
}
