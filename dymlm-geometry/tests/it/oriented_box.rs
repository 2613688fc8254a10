//! Overlap of oriented boxes against exact cases, brute force and what must hold for any two boxes.
use dymlm_core::Pose;
use dymlm_geometry::{OrientedBox, OrientedBoxError};
use dymlm_test_support::cases;
use proptest::prelude::*;

fn at(translation: [f64; 3], lengths: [f64; 3]) -> OrientedBox {
    OrientedBox::new(Pose::new(translation, [0.0, 0.0, 0.0, 1.0]).unwrap(), lengths).unwrap()
}

fn turned(axis: [f64; 3], angle: f64, translation: [f64; 3], lengths: [f64; 3]) -> OrientedBox {
    OrientedBox::new(pose(axis, angle, translation), lengths).unwrap()
}

fn pose(axis: [f64; 3], angle: f64, translation: [f64; 3]) -> Pose {
    let norm = axis.iter().map(|c| c * c).sum::<f64>().sqrt();
    let (sin, cos) = (0.5 * angle).sin_cos();
    let [x, y, z] = axis.map(|c| c / norm * sin);
    Pose::new(translation, [x, y, z, cos]).unwrap()
}

fn any_pose(reach: f64) -> impl Strategy<Value = Pose> {
    (prop::array::uniform3(-1.0..1.0_f64), -3.2..3.2_f64, prop::array::uniform3(-reach..reach))
        .prop_map(|(axis, angle, place)| pose([axis[0] + 1e-3, axis[1], axis[2] + 2.0], angle, place))
}

fn any_box() -> impl Strategy<Value = OrientedBox> {
    (any_pose(0.6), prop::array::uniform3(0.05..1.5_f64))
        .prop_map(|(pose, lengths)| OrientedBox::new(pose, lengths).unwrap())
}

/// Boxes whose faces often share planes: on a grid, turned by quarter turns.
fn grid_box() -> impl Strategy<Value = OrientedBox> {
    let quarter = std::f64::consts::FRAC_PI_2;
    (0..4_u8, 0..4_u8, prop::array::uniform3(0..4_u8), prop::array::uniform3(0..4_u8)).prop_map(
        move |(about_z, about_x, place, lengths)| {
            let spin = pose([0.0, 0.0, 1.0], quarter * f64::from(about_z), [0.0; 3])
                * pose([1.0, 0.0, 0.0], quarter * f64::from(about_x), [0.0; 3]);
            let place = Pose::new(place.map(|c| 0.5 * f64::from(c)), [0.0, 0.0, 0.0, 1.0]).unwrap();
            OrientedBox::new(place * spin, lengths.map(f64::from)).unwrap()
        },
    )
}

/// Volume shared by two boxes whose sides run along the world's axes, in any order.
fn axis_aligned_overlap(a: &OrientedBox, b: &OrientedBox) -> f64 {
    let bounds = |own: &OrientedBox, axis: usize| {
        let along = own.corners().map(|corner| corner[axis]);
        (
            along.iter().copied().fold(f64::INFINITY, f64::min),
            along.iter().copied().fold(f64::NEG_INFINITY, f64::max),
        )
    };
    (0..3)
        .map(|axis| {
            let ((low_a, high_a), (low_b, high_b)) = (bounds(a, axis), bounds(b, axis));
            (high_a.min(high_b) - low_a.max(low_b)).max(0.0)
        })
        .product()
}

/// The shared volume by counting the middles of the cells of a grid over `a` that lie in `b`.
fn counted_overlap(a: &OrientedBox, b: &OrientedBox, cells: u32) -> f64 {
    let lengths = a.lengths();
    let middle = |i: u32, axis: usize| ((f64::from(i) + 0.5) / f64::from(cells) - 0.5) * lengths[axis];
    let mut inside = 0_u32;
    for i in 0..cells {
        for j in 0..cells {
            for k in 0..cells {
                let local = [middle(i, 0), middle(j, 1), middle(k, 2)];
                inside += u32::from(b.contains(a.world_from_box().transform_point(local)));
            }
        }
    }
    a.volume() * f64::from(inside) / f64::from(cells).powi(3)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(100)))]

    #[test]
    fn equals_the_count_of_a_fine_grid(a in any_box(), b in any_box()) {
        let counted = counted_overlap(&a, &b, 40);
        // The boundary passes through a share of the cells that shrinks with their size.
        let error = a.volume() * 0.02;
        prop_assert!((a.intersection_volume(&b) - counted).abs() < error);
    }

    #[test]
    fn is_symmetric_bounded_and_unmoved_by_rigid_motion(
        a in any_box(), b in any_box(), motion in any_pose(100.0),
    ) {
        let shared = a.intersection_volume(&b);
        let bound = a.volume().min(b.volume());
        prop_assert!((0.0..=bound).contains(&shared));
        prop_assert!((shared - b.intersection_volume(&a)).abs() < 1e-13);
        let moved = a.transformed(&motion).intersection_volume(&b.transformed(&motion));
        prop_assert!((shared - moved).abs() < 1e-11, "{} moved to {}", shared, moved);
        let iou = a.iou(&b);
        prop_assert!((iou - shared / (a.volume() + b.volume() - shared)).abs() < 1e-12);
    }

    #[test]
    fn what_is_inside_and_outside_a_half_adds_up(a in any_box(), b in any_box(), share in 0.0..1.0_f64) {
        // b cut in two by a plane across its first axis.
        let [length, width, height] = b.lengths();
        let half = |from: f64, to: f64| {
            let place = Pose::new([0.5 * (from + to) - 0.5 * length, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
            OrientedBox::new(b.world_from_box() * place, [to - from, width, height]).unwrap()
        };
        let cut = share * length;
        let parts = a.intersection_volume(&half(0.0, cut)) + a.intersection_volume(&half(cut, length));
        prop_assert!((a.intersection_volume(&b) - parts).abs() < 1e-12);
    }

    #[test]
    fn a_box_shares_all_with_itself_and_with_what_holds_it(a in any_box(), inner in prop::array::uniform3(0.0..1.0_f64)) {
        prop_assert!((a.intersection_volume(&a) - a.volume()).abs() < 1e-13);
        prop_assert!((a.iou(&a) - 1.0).abs() < 1e-12);
        let lengths = a.lengths();
        let smaller: [f64; 3] = std::array::from_fn(|k| lengths[k] * inner[k]);
        // Against one corner, so that three faces are shared.
        let corner = Pose::new(
            std::array::from_fn(|k| 0.5 * (lengths[k] - smaller[k])), [0.0, 0.0, 0.0, 1.0],
        ).unwrap();
        let nested = OrientedBox::new(a.world_from_box() * corner, smaller).unwrap();
        prop_assert!((a.intersection_volume(&nested) - nested.volume()).abs() < 1e-13);
        prop_assert!((nested.intersection_volume(&a) - nested.volume()).abs() < 1e-13);
    }

    #[test]
    fn shared_face_planes_are_exact(a in grid_box(), b in grid_box(), motion in any_pose(10.0)) {
        let exact = axis_aligned_overlap(&a, &b);
        prop_assert!((a.intersection_volume(&b) - exact).abs() < 1e-12, "{} for {}", a.intersection_volume(&b), exact);
        let moved = a.transformed(&motion).intersection_volume(&b.transformed(&motion));
        prop_assert!((moved - exact).abs() < 1e-11, "{} for {} after {:?}", moved, exact, motion);
    }

    #[test]
    fn nearly_shared_planes_are_as_good(
        a in grid_box(), b in grid_box(), axis in prop::array::uniform3(-1.0..1.0_f64), power in 6..17_i32,
    ) {
        // b turned and moved by next to nothing: rounding decides about everything, and must not matter.
        let tiny = 10.0_f64.powi(-power);
        let nudge = pose([axis[0], axis[1], axis[2] + 1.5], tiny, axis.map(|c| c * tiny));
        let exact = axis_aligned_overlap(&a, &b);
        // Areas are at most 9 m2 on six faces, and a turn moves corners by up to 6 m times its angle.
        prop_assert!((a.intersection_volume(&b.transformed(&nudge)) - exact).abs() < 1e-11 + 400.0 * tiny);
    }

    #[test]
    fn far_away_boxes_overlap_as_near_ones(a in any_box(), b in any_box(), power in 0..13_i32) {
        let far = Pose::new([-2.0_f64.powi(3 * power), 2.0_f64.powi(2 * power), 1.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        // Coordinates that large are rounded themselves.
        let rounding = 2.0_f64.powi(3 * power) * f64::EPSILON * 20.0;
        let moved = a.transformed(&far).intersection_volume(&b.transformed(&far));
        prop_assert!((moved - a.intersection_volume(&b)).abs() < 1e-12 + rounding);
    }

    #[test]
    fn scale_does_not_matter(a in any_box(), b in any_box(), power in -40..40_i32) {
        let scale = 2.0_f64.powi(power);
        let scaled = |own: &OrientedBox| {
            let place = Pose::new(own.center().map(|c| c * scale), own.world_from_box().quaternion()).unwrap();
            OrientedBox::new(place, own.lengths().map(|length| length * scale)).unwrap()
        };
        let relative = scaled(&a).intersection_volume(&scaled(&b)) / scale.powi(3);
        prop_assert!((relative - a.intersection_volume(&b)).abs() < 1e-14);
    }

    #[test]
    fn corners_are_in_the_box_and_what_is_beyond_them_is_not(a in any_box()) {
        let center = a.center();
        for corner in a.corners() {
            let scaled = |factor: f64| std::array::from_fn(|k| center[k] + factor * (corner[k] - center[k]));
            prop_assert!(a.contains(scaled(1.0 - 1e-9)) && !a.contains(scaled(1.0 + 1e-9)));
        }
    }
}

#[test]
fn known_volumes() {
    let cube = at([0.0; 3], [1.0; 3]);
    let close = |volume: f64, exact: f64| assert!((volume - exact).abs() < 1e-12, "{volume} is not {exact}");

    // An octagonal prism: two unit squares turned by 45 degrees share 2 (sqrt 2 - 1).
    let prism = turned([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_4, [0.0; 3], [1.0; 3]);
    close(cube.intersection_volume(&prism), 2.0 * (2.0_f64.sqrt() - 1.0));

    // A cube standing on its corner, cut by the plane through its middle: half of it.
    let axis = [1.0, -1.0, 0.0];
    let on_corner = turned(axis, (1.0 / 3.0_f64.sqrt()).acos(), [0.0; 3], [1.0; 3]);
    close(on_corner.intersection_volume(&at([0.0, 0.0, 5.0], [10.0; 3])), 0.5);
    // Its tip: the three edges that meet in it are all cut at a height h below it; the tetrahedron has volume
    // h^3 sqrt 3 / 2.
    let (tip, h) = (0.5 * 3.0_f64.sqrt(), 0.2);
    close(
        on_corner.intersection_volume(&at([0.0, 0.0, tip - h + 5.0], [10.0; 3])),
        h.powi(3) * 3.0_f64.sqrt() / 2.0,
    );

    // A rod through a cube along the diagonal of a face, longer than the diagonal.
    let rod = turned([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_4, [0.0; 3], [10.0, 0.01, 0.5]);
    close(cube.intersection_volume(&rod), 0.5 * (0.01 * 2.0_f64.sqrt() - 0.01 * 0.01 / 2.0));

    // Touching in a face, an edge, a corner; apart.
    for place in [[1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [1.0; 3], [1.5, 0.0, 0.0], [0.0, -3e9, 0.0]] {
        close(cube.intersection_volume(&at(place, [1.0; 3])), 0.0);
    }
    let edge_on_face =
        turned([0.0, 0.0, 1.0], std::f64::consts::FRAC_PI_4, [0.5 + 0.5_f64.sqrt(), 0.0, 0.0], [1.0; 3]);
    close(cube.intersection_volume(&edge_on_face), 0.0);
}

#[test]
fn flat_boxes_have_no_volume_and_thin_ones_the_right_one() {
    let cube = at([0.0; 3], [1.0; 3]);
    let sheet = turned([1.0, 0.3, 0.2], 0.7, [0.1; 3], [0.5, 0.4, 0.0]);
    let point = at([0.0; 3], [0.0; 3]);
    for flat in [sheet, point, at([0.0; 3], [0.0, 0.0, 3.0])] {
        assert_eq!(cube.intersection_volume(&flat), 0.0);
        assert_eq!((flat.iou(&flat), flat.iou(&cube), flat.volume()), (0.0, 0.0, 0.0));
    }
    assert!(
        sheet.contains(sheet.center()) && point.contains([0.0; 3]) && !point.contains([1e-300, 0.0, 0.0])
    );

    for thickness in [1e-3, 1e-6, 1e-9] {
        let thin = at([0.25, 0.0, 0.0], [1.0, 1.0, thickness]);
        let shared = thin.intersection_volume(&at([0.0; 3], [1.0, 1.0, thickness]));
        assert!((shared / thickness - 0.75).abs() < 1e-4, "{shared} of {thickness}");
    }
}

#[test]
fn extremes_do_no_harm() {
    let huge = at([0.0; 3], [OrientedBox::MAX_LENGTH; 3]);
    assert!((huge.iou(&huge) - 1.0).abs() < 1e-12);
    assert!((huge.intersection_volume(&at([1.0; 3], [2.0; 3])) - 8.0).abs() < 1e-9);
    let ends = [1.0, -1.0].map(|sign| at([sign * f64::MAX, 0.0, 0.0], [1.0; 3]));
    assert_eq!(ends[0].intersection_volume(&ends[1]), 0.0);
    assert_eq!(ends[0].intersection_volume(&at([0.0; 3], [OrientedBox::MAX_LENGTH; 3])), 0.0);
    let cube = at([0.0; 3], [1.0; 3]);
    assert!(!cube.contains([f64::NAN, 0.0, 0.0]) && !cube.contains([0.0, f64::INFINITY, 0.0]));

    for lengths in [[-0.1, 1.0, 1.0], [1.0, f64::NAN, 1.0], [1.0, 1.0, f64::INFINITY], [1.0, 1.0, 2e15]] {
        let OrientedBoxError { lengths: refused, .. } =
            OrientedBox::new(Pose::identity(), lengths).unwrap_err();
        assert!(refused.iter().zip(lengths).all(|(a, b)| a.to_bits() == b.to_bits()));
    }
}

proptest! {
    #[test]
    fn the_box_around_boxes_touches_their_outermost_corners(boxes in prop::collection::vec(any_box(), 1..5)) {
        let around = OrientedBox::around(&boxes).unwrap();
        let rim = around.with_rim(1e-12).unwrap();
        prop_assert!(boxes.iter().flat_map(OrientedBox::corners).all(|corner| rim.contains(corner)));
        let less = around.with_rim(-1e-9).unwrap();
        for axis in 0..3 {
            let half = 0.5 * less.lengths()[axis];
            let outside = |corner: [f64; 3]| (corner[axis] - less.center()[axis]) / half;
            let corners = || boxes.iter().flat_map(OrientedBox::corners).map(outside);
            prop_assert!(corners().any(|side| side > 1.0) && corners().any(|side| side < -1.0));
        }
    }
}

#[test]
fn there_is_no_box_around_nothing_nor_between_corners_that_are_none() {
    assert_eq!(OrientedBox::around(&[]), None);
    assert!(OrientedBox::between([0.0; 3], [1.0, -1.0, 1.0]).is_err());
    assert!(OrientedBox::between([f64::NAN; 3], [1.0; 3]).is_err());
    assert!(OrientedBox::between([-1e16; 3], [1e16; 3]).is_err());
    assert_eq!(
        OrientedBox::between([1.0, 2.0, 3.0], [2.0, 2.0, 5.0]).unwrap(),
        at([1.5, 2.0, 4.0], [1.0, 0.0, 2.0])
    );
}
