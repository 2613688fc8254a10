//! Boxes around clouds: what they hold, that they move with the cloud, and degenerate clouds.
use crate::common::poses;
use dymlm_core::{Point, Pose};
use dymlm_geometry::{
    BoxFit, OrientedBox, OrientedBoxScratch, PrincipalAxes, fit_oriented_box, fit_oriented_box_with,
};
use dymlm_test_support::cases;
use proptest::prelude::*;

fn clouds() -> impl Strategy<Value = Vec<Point>> {
    let points = |point: BoxedStrategy<Point>| prop::collection::vec(point, 1..300);
    let lattice = prop::array::uniform3(-2..3_i8).prop_map(|p| p.map(f32::from)).boxed();
    let flat = prop::array::uniform2(-1.0..1.0_f32).prop_map(|[x, y]| [x, y, 0.3]).boxed();
    let line = (-1.0..1.0_f32).prop_map(|t| [t, 2.0 * t, -t]).boxed();
    prop_oneof![
        2 => points(prop::array::uniform3(-1.0..1.0_f32).boxed()),
        1 => points(lattice),
        1 => points(flat),
        1 => points(line),
    ]
}

fn fits() -> impl Strategy<Value = BoxFit> {
    prop_oneof![
        Just(BoxFit::PrincipalAxes),
        Just(BoxFit::MinimumRectangle),
        Just(BoxFit::MinimumVolume),
        prop::array::uniform3(-2.0..2.0_f64).prop_filter_map("no direction", |up| {
            (up.iter().any(|x| x.abs() > 0.01)).then_some(BoxFit::Upright { up })
        }),
    ]
}

fn moved(points: &[Point], by: &Pose) -> Vec<Point> {
    points.iter().map(|point| by.transform_point(point.map(f64::from)).map(|x| x as f32)).collect()
}

fn axes(own: &OrientedBox) -> [[f64; 3]; 3] {
    [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|axis| own.world_from_box().rotate(axis))
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// How far the cloud extends along a direction.
fn extent(points: &[Point], direction: [f64; 3]) -> f64 {
    let along = || points.iter().map(|point| dot(point.map(f64::from), direction));
    along().fold(f64::NEG_INFINITY, f64::max) - along().fold(f64::INFINITY, f64::min)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(200)))]

    #[test]
    fn every_point_is_inside_and_every_side_touched(points in clouds(), fit in fits(), pose in poses(), far in prop_oneof![Just(1.0_f32), Just(1e6)]) {
        let points: Vec<Point> = moved(&points, &pose).iter().map(|p| p.map(|x| x * far)).collect();
        let own = fit_oriented_box(&points, fit).unwrap();
        for point in &points {
            prop_assert!(own.contains(point.map(f64::from)), "{point:?} {own:?}");
        }
        for (axis, length) in axes(&own).into_iter().zip(own.lengths()) {
            prop_assert!((length - extent(&points, axis)).abs() < 1e-13 * f64::from(far));
        }
    }

    #[test]
    fn the_first_axes_point_to_positive_and_the_third_up(points in clouds(), fit in fits()) {
        let [x, y, z] = axes(&fit_oriented_box(&points, fit).unwrap());
        // Of components that are equal but for rounding, any may be the greatest.
        let is_positive = |axis: [f64; 3]| {
            let greatest = axis.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
            axis.iter().any(|&x| x > greatest - 1e-12)
        };
        prop_assert!(is_positive(x));
        if let BoxFit::Upright { up } = fit {
            prop_assert!((dot(z, up) / dot(up, up).sqrt() - 1.0).abs() < 1e-14);
        } else {
            prop_assert!(is_positive(y));
        }
    }

    /// Sizes do not change with the frame (nor does the order of the points matter, beyond rounding of their
    /// sums).
    #[test]
    fn sizes_follow_rigid_motions(
        points in prop::collection::vec(prop::array::uniform3(-1.0..1.0_f32).prop_map(|[x, y, z]| [3.0 * x, 2.0 * y, z]), 30..300),
        pose in poses(),
        fit in fits(),
    ) {
        let mut there: Vec<Point> = moved(&points, &pose);
        there.reverse();
        let fit_there = match fit {
            BoxFit::Upright { up } => BoxFit::Upright { up: pose.rotate(up) },
            other => other,
        };
        let (here, there) = (fit_oriented_box(&points, fit).unwrap(), fit_oriented_box(&there, fit_there).unwrap());
        // f32 coordinates move by 1e-7; another edge of nearly the same area may win, principal axes turn a
        // little.
        prop_assert!((here.volume() - there.volume()).abs() < 1e-4 * here.volume(), "{here:?} {there:?}");
    }

    /// The footprint's rectangle is no larger than that along the principal axes.
    #[test]
    fn the_rectangle_never_makes_a_box_larger(points in clouds()) {
        let plain = fit_oriented_box(&points, BoxFit::PrincipalAxes).unwrap();
        let corrected = fit_oriented_box(&points, BoxFit::MinimumRectangle).unwrap();
        prop_assert!(corrected.volume() <= plain.volume() + 1e-12);
        prop_assert!(corrected.lengths()[0] >= corrected.lengths()[1] - 1e-13);
    }

    #[test]
    fn principal_axes_are_those_of_the_cloud(points in clouds()) {
        let own = fit_oriented_box(&points, BoxFit::PrincipalAxes).unwrap();
        let expected = PrincipalAxes::of(&points).unwrap().axes;
        for (axis, expected) in axes(&own).into_iter().zip(expected) {
            prop_assert!((dot(axis, expected) - 1.0).abs() < 1e-14);
        }
    }

    #[test]
    fn points_that_are_no_numbers_and_old_buffers_do_not_matter(
        clouds in prop::collection::vec(clouds(), 2..4),
        fit in fits(),
        holes in prop::collection::vec((0..300_usize, 0..3_usize, 0..3_usize), 1..9),
    ) {
        let mut scratch = OrientedBoxScratch::default();
        for points in clouds {
            let mut all = points.clone();
            for &(place, axis, kind) in &holes {
                let mut hole = [0.1; 3];
                hole[axis] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][kind];
                all.insert(place.min(all.len()), hole);
            }
            let (with_holes, without) = (fit_oriented_box_with(&all, fit, &mut scratch).unwrap(), fit_oriented_box(&points, fit).unwrap());
            // Sums run in another order, and a descent that begins elsewhere ends elsewhere; all else is as it
            // was.
            let allowed = if fit == BoxFit::MinimumVolume { 1e-6 } else { 1e-9 };
            let (with_holes, without) = (with_holes.volume(), without.volume());
            prop_assert!((with_holes - without).abs() <= allowed * (1.0 + without), "{with_holes} {without}");
        }
    }
}

/// The box around a turned grid of points is the grid's own box.
#[test]
fn a_turned_box_is_found() {
    let points: Vec<Point> = (0..11)
        .flat_map(|i| {
            (0..7).flat_map(move |j| (0..4).map(move |k| [0.1 * i as f32, 0.1 * j as f32, 0.1 * k as f32]))
        })
        .collect();
    let pose = Pose::new([0.5, -1.0, 2.0], [0.1, -0.7, 0.1, 0.7]).unwrap();
    let up = pose.rotate([0.0, 0.0, 1.0]);
    for fit in
        [BoxFit::PrincipalAxes, BoxFit::MinimumRectangle, BoxFit::MinimumVolume, BoxFit::Upright { up }]
    {
        let own = fit_oriented_box(&moved(&points, &pose), fit).unwrap();
        for (length, expected) in own.lengths().into_iter().zip([1.0, 0.6, 0.3]) {
            assert!((length - expected).abs() < 1e-6, "{own:?}");
        }
        let center = pose.transform_point([0.5, 0.3, 0.15]);
        assert!((0..3).all(|axis| (own.center()[axis] - center[axis]).abs() < 1e-6), "{own:?}");
    }
}

/// A square footprint has no principal axes: the rectangle corrects what uneven sampling does to them.
#[test]
fn the_rectangle_corrects_the_yaw_of_a_square() {
    let mut points: Vec<Point> =
        (0..21).flat_map(|i| (0..21).map(move |j| [0.05 * i as f32, 0.05 * j as f32, 0.0])).collect();
    // Two opposite corners were seen more often.
    points.extend((0..200).map(|i| [0.001 * (i % 50) as f32, 0.001 * (i / 50) as f32, 0.1]));
    points.extend((0..200).map(|i| [1.0 - 0.001 * (i % 50) as f32, 1.0 - 0.001 * (i / 50) as f32, 0.1]));
    let plain = fit_oriented_box(&points, BoxFit::PrincipalAxes).unwrap();
    assert!(plain.lengths()[0] > 1.4, "{plain:?}");
    let upright = fit_oriented_box(&points, BoxFit::Upright { up: [0.0, 0.0, 3.0] }).unwrap();
    let expected = [1.0, 1.0, 0.1];
    assert!((0..3).all(|axis| (upright.lengths()[axis] - expected[axis]).abs() < 1e-6), "{upright:?}");
}

#[test]
fn degenerate_clouds_have_flat_boxes_or_none() {
    for fit in [
        BoxFit::PrincipalAxes,
        BoxFit::MinimumRectangle,
        BoxFit::MinimumVolume,
        BoxFit::Upright { up: [0.0, -1.0, 0.0] },
    ] {
        assert_eq!(fit_oriented_box(&[], fit), None);
        assert_eq!(fit_oriented_box(&[[f32::NAN, 0.0, 0.0], [0.0, f32::INFINITY, 0.0]], fit), None);
        assert_eq!(fit_oriented_box(&[[f32::MAX; 3], [-f32::MAX; 3]], fit), None);
        for count in [1, 2, 700] {
            let place = fit_oriented_box(&vec![[1.0, 2.0, 3.0]; count], fit).unwrap();
            assert_eq!(place.center(), [1.0, 2.0, 3.0]);
            assert!(place.lengths().iter().all(|length| *length < 1e-13));
        }
        let line = fit_oriented_box(&[[0.0; 3], [0.0, 3.0, 4.0], [0.0, 1.5, 2.0]], fit).unwrap();
        assert!(line.volume() < 1e-12 && line.contains([0.0, 1.5, 2.0]));
    }
    let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    for up in [[0.0; 3], [f64::NAN, 0.0, 1.0], [f64::INFINITY, 0.0, 0.0]] {
        assert_eq!(fit_oriented_box(&points, BoxFit::Upright { up }), None);
    }
    for length in [1e-300, 5e-324, 1e300] {
        let own = fit_oriented_box(&points, BoxFit::Upright { up: [0.0, 0.0, length] }).unwrap();
        assert!((own.lengths()[2]).abs() < 1e-13 && own.lengths()[0] > 0.99);
    }
}
