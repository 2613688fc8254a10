//! Hull and minimum-area rectangle against brute force, under rigid motions, and on degenerate input.
use std::cmp::Ordering;

use dymlm_geometry::{
    ConvexHullScratch, MinimumAreaRectangleScratch, OrientedRectangle, convex_hull, convex_hull_into,
    minimum_area_rectangle, minimum_area_rectangle_with,
};
use dymlm_test_support::{cases, shuffle};
use proptest::prelude::*;

/// Points of every kind: spread, on the sides of a rectangle, on a small lattice (duplicates, many on a
/// line), on one line, on a circle, two clusters far apart.
fn clouds(most: usize) -> impl Strategy<Value = Vec<[f64; 2]>> {
    let points = move |point: BoxedStrategy<[f64; 2]>| prop::collection::vec(point, 1..most);
    let lattice = prop::array::uniform2(-3..4_i8).prop_map(|p| p.map(f64::from)).boxed();
    let line = (-50..50_i8).prop_map(|t| [0.3 + 0.1 * f64::from(t), 0.7 - 0.3 * f64::from(t)]).boxed();
    let circle = (0.0..std::f64::consts::TAU).prop_map(|t| [t.cos(), t.sin()]).boxed();
    let clusters = (any::<bool>(), prop::array::uniform2(-1e-6..1e-6_f64))
        .prop_map(|(far, [x, y])| if far { [1000.0 + x, 500.0 + y] } else { [x, y] })
        .boxed();
    // On the sides of a turned, more or less thin rectangle, with noise.
    let outline = (0.01..1.0_f64, 0.0..1.0_f64, -1.0..1.0_f64, any::<bool>(), any::<bool>(), 0..3_i32)
        .prop_map(|(thin, along, noise, across, far, digits)| {
            let side = if far { 1.0 } else { -1.0 } + 10.0_f64.powi(-3 * digits - 2) * noise;
            let [s, t] = if across { [side, along] } else { [2.0 * along - 1.0, side] };
            let thin = if thin < 0.5 { 0.3 } else { 1e-5 };
            [0.8 * s - 0.6 * thin * t, 0.6 * s + 0.8 * thin * t]
        });
    let outline = outline.boxed();
    prop_oneof![
        3 => points(prop::array::uniform2(-1.0..1.0_f64).boxed()),
        1 => points(outline),
        2 => points(lattice),
        1 => points(line),
        1 => points(circle),
        1 => points(clusters),
    ]
}

/// The sign of the determinant in integers, for points on the lattice of halves.
fn turn(a: [f64; 2], b: [f64; 2], c: [f64; 2]) -> Ordering {
    let [a, b, c] = [a, b, c].map(|p| p.map(|x| (2.0 * x) as i64));
    ((b[0] - a[0]) * (c[1] - a[1])).cmp(&((b[1] - a[1]) * (c[0] - a[0])))
}

/// Whether a lattice point is a strict corner: no other two enclose it in a segment, no other three in a
/// triangle.
fn is_corner(point: [f64; 2], others: &[[f64; 2]]) -> bool {
    let between = |a: [f64; 2], b: [f64; 2]| {
        let (to_a, to_b) = ([a[0] - point[0], a[1] - point[1]], [b[0] - point[0], b[1] - point[1]]);
        turn(a, point, b) == Ordering::Equal && to_a[0] * to_b[0] + to_a[1] * to_b[1] < 0.0
    };
    let within = |a, b, c| {
        let turns = [turn(a, b, point), turn(b, c, point), turn(c, a, point)];
        turns == [Ordering::Greater; 3] || turns == [Ordering::Less; 3]
    };
    let n = others.len();
    (0..n).all(|i| {
        (0..i).all(|k| {
            !between(others[i], others[k]) && (0..k).all(|l| !within(others[i], others[k], others[l]))
        })
    })
}

/// Andrew's scan over all points, by the predicates of crate `robust`.
fn plain_hull(points: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let mut sorted: Vec<_> = points.iter().map(|p| p.map(|x| x + 0.0)).collect();
    sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
    sorted.dedup();
    let coord = |[x, y]: [f64; 2]| robust::Coord { x, y };
    let chain = |points: &mut dyn Iterator<Item = [f64; 2]>| {
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for p in points {
            while let [.., a, b] = chain[..]
                && robust::orient2d(coord(a), coord(b), coord(p)) <= 0.0
            {
                chain.pop();
            }
            chain.push(p);
        }
        chain
    };
    let (mut lower, upper) = (chain(&mut sorted.iter().copied()), chain(&mut sorted.iter().rev().copied()));
    if lower.len() > 1 {
        lower.pop();
        lower.extend(&upper[..upper.len() - 1]);
    }
    lower
}

/// Least area over all edges, and over all rectangles along the edge: by projecting all points.
fn brute_force_area(hull: &[[f64; 2]]) -> f64 {
    let extent = |direction: [f64; 2]| {
        let distances =
            hull.iter().map(|p| (p[0] - hull[0][0]) * direction[0] + (p[1] - hull[0][1]) * direction[1]);
        let (min, max) =
            distances.fold((f64::INFINITY, f64::NEG_INFINITY), |(min, max), d| (d.min(min), d.max(max)));
        max - min
    };
    (0..hull.len())
        .map(|i| {
            let (a, b) = (hull[i], hull[(i + 1) % hull.len()]);
            let length = (b[0] - a[0]).hypot(b[1] - a[1]);
            let [x, y] =
                if length > 0.0 { [(b[0] - a[0]) / length, (b[1] - a[1]) / length] } else { [1.0, 0.0] };
            extent([x, y]) * extent([-y, x])
        })
        .fold(f64::INFINITY, f64::min)
}

fn scale(points: &[[f64; 2]]) -> f64 {
    points.iter().flatten().fold(0.0, |greatest: f64, x| greatest.max(x.abs()))
}

/// How far the farthest point lies outside.
fn excess(rectangle: &OrientedRectangle, points: &[[f64; 2]]) -> f64 {
    let outside = |direction: [f64; 2], length: f64, p: &[f64; 2]| {
        let distance =
            (p[0] - rectangle.center[0]) * direction[0] + (p[1] - rectangle.center[1]) * direction[1];
        distance.abs() - 0.5 * length
    };
    points
        .iter()
        .map(|p| {
            outside(rectangle.axis, rectangle.lengths[0], p).max(outside(
                rectangle.cross_axis(),
                rectangle.lengths[1],
                p,
            ))
        })
        .fold(f64::NEG_INFINITY, f64::max)
}

fn check_rectangle(points: &[[f64; 2]]) -> Result<(), TestCaseError> {
    let rectangle = minimum_area_rectangle(points).unwrap();
    let scale = scale(points).max(1e-300);
    let area = brute_force_area(&convex_hull(points));
    prop_assert!((rectangle.area() - area).abs() <= 1e-12 * scale * scale, "{} {area}", rectangle.area());
    prop_assert!(excess(&rectangle, points) <= 1e-14 * scale, "{rectangle:?}");
    prop_assert!(rectangle.lengths[0] >= rectangle.lengths[1] && rectangle.lengths[1] >= 0.0);
    let [x, y] = rectangle.axis;
    prop_assert!((x.hypot(y) - 1.0).abs() < 1e-15 && (x > 0.0 || (x == 0.0 && y > 0.0)));
    Ok(())
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(200)))]

    #[test]
    fn hull_is_the_strict_corners(
        points in prop::collection::vec(prop::array::uniform2(-6..7_i8).prop_map(|p| p.map(|x| 0.5 * f64::from(x))), 1..14),
    ) {
        let mut distinct = points.clone();
        distinct.sort_by(|a, b| a.partial_cmp(b).unwrap());
        distinct.dedup();
        let others = |p: [f64; 2]| distinct.iter().copied().filter(|q| *q != p).collect::<Vec<_>>();
        let mut corners: Vec<_> = distinct.iter().copied().filter(|p| is_corner(*p, &others(*p))).collect();
        let hull = convex_hull(&points);
        // Counter-clockwise from the first corner, the leftmost and lowest.
        prop_assert_eq!(hull[0], corners[0]);
        for i in 0..hull.len() {
            if hull.len() > 2 {
                let next = [hull[(i + 1) % hull.len()], hull[(i + 2) % hull.len()]];
                prop_assert_eq!(turn(hull[i], next[0], next[1]), Ordering::Greater);
            }
        }
        let mut sorted = hull;
        sorted.sort_by(|a, b| a.partial_cmp(b).unwrap());
        corners.sort_by(|a, b| a.partial_cmp(b).unwrap());
        prop_assert_eq!(sorted, corners);
    }

    #[test]
    fn rectangle_equals_brute_force_over_all_edges(points in clouds(60)) {
        check_rectangle(&points)?;
    }

}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(40)))]

    #[test]
    fn hull_of_many_equals_a_plain_scan(points in clouds(4000), offset in prop_oneof![Just(0.0), -1e7..1e7_f64, Just(1e13)]) {
        let points: Vec<_> = points.iter().map(|p| p.map(|x| x + offset)).collect();
        prop_assert_eq!(convex_hull(&points), plain_hull(&points));
    }

    #[test]
    fn rectangle_of_many_points(points in clouds(3000)) {
        check_rectangle(&points)?;
    }

    #[test]
    fn order_is_no_matter(points in clouds(1500), seed in any::<u64>()) {
        let mut shuffled = points.clone();
        shuffle(&mut shuffled, seed);
        prop_assert_eq!(convex_hull(&points), convex_hull(&shuffled));
        prop_assert_eq!(minimum_area_rectangle(&points), minimum_area_rectangle(&shuffled));
    }

    #[test]
    fn area_follows_rigid_motions(points in clouds(100), angle in -3.2..3.2_f64, shift in prop::array::uniform2(-9.0..9.0_f64)) {
        let (sin, cos) = angle.sin_cos();
        let moved: Vec<_> =
            points.iter().map(|[x, y]| [cos * x - sin * y + shift[0], sin * x + cos * y + shift[1]]).collect();
        let (here, there) = (minimum_area_rectangle(&points).unwrap(), minimum_area_rectangle(&moved).unwrap());
        prop_assert!((here.area() - there.area()).abs() <= 1e-12 * scale(&points).max(10.0).powi(2));
    }

    #[test]
    fn points_that_are_no_numbers_are_passed_over(points in clouds(900), holes in prop::collection::vec((0..900_usize, 0..8_usize), 1..9)) {
        let mut all = points.clone();
        for (place, kind) in holes {
            let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY, 2e120][kind / 2];
            all.insert(place.min(all.len()), if kind % 2 == 0 { [bad, 0.1] } else { [0.1, bad] });
        }
        prop_assert_eq!(convex_hull(&all), convex_hull(&points));
        prop_assert_eq!(minimum_area_rectangle(&all), minimum_area_rectangle(&points));
    }

    #[test]
    fn old_buffers_do_not_matter(clouds in prop::collection::vec(clouds(1200), 2..4)) {
        let (mut hull_scratch, mut scratch) = (ConvexHullScratch::default(), MinimumAreaRectangleScratch::default());
        let mut hull = Vec::new();
        for points in &clouds {
            convex_hull_into(points, &mut hull_scratch, &mut hull);
            prop_assert_eq!(&hull, &convex_hull(points));
            prop_assert_eq!(minimum_area_rectangle_with(points, &mut scratch), minimum_area_rectangle(points));
        }
    }
}

/// A million random cases: `cargo test --release -p dymlm-geometry --test it -- --ignored million`.
#[test]
#[ignore = "a minute"]
fn a_million_rectangles_equal_brute_force() {
    let mut runner = proptest::test_runner::TestRunner::new(ProptestConfig::with_cases(1_000_000));
    runner.run(&clouds(40), |points| check_rectangle(&points)).unwrap();
}

#[test]
fn degenerate_clouds_have_plain_answers() {
    assert_eq!(convex_hull(&[]), Vec::<[f64; 2]>::new());
    assert_eq!(minimum_area_rectangle(&[]), None);
    assert_eq!(minimum_area_rectangle(&[[f64::NAN, 0.0], [1.0, f64::INFINITY]]), None);
    for count in [1, 3, 1000] {
        assert_eq!(convex_hull(&vec![[2.0, -1.0]; count]), [[2.0, -1.0]]);
        let place = minimum_area_rectangle(&vec![[2.0, -1.0]; count]).unwrap();
        assert_eq!((place.center, place.axis, place.lengths), ([2.0, -1.0], [1.0, 0.0], [0.0, 0.0]));
    }
    for count in [2, 5, 2000] {
        let line: Vec<_> =
            (0..count).map(|i| f64::from(i) / f64::from(count - 1)).map(|t| [3.0 * t, -4.0 * t]).collect();
        assert_eq!(convex_hull(&line)[..1], [[0.0, 0.0]]);
        let rectangle = minimum_area_rectangle(&line).unwrap();
        assert!((rectangle.lengths[0] - 5.0).abs() < 1e-14 && rectangle.lengths[1] < 1e-15, "{rectangle:?}");
        assert!((rectangle.axis[0] - 0.6).abs() < 1e-14 && (rectangle.axis[1] + 0.8).abs() < 1e-14);
    }
}

/// Where all areas are only rounding, no edge may win by a negative area.
#[test]
fn a_line_that_rounding_bends_is_enclosed() {
    let bent = [
        [3.9, -10.1],
        [1.2, -1.999_999_999_999_999_8],
        [-1.900_000_000_000_000_1, 7.3],
        [-4.2, 14.2],
        [0.5, 0.099_999_999_999_999_98],
        [-2.500_000_000_000_000_4, 9.1],
        [-1.0, 4.6],
    ];
    check_rectangle(&bent).unwrap();
}

#[test]
fn zeros_of_either_sign_are_one_place() {
    assert_eq!(convex_hull(&[[0.0, -0.0], [-0.0, 0.0], [-0.0, -0.0]]), [[0.0, 0.0]]);
    let bits = convex_hull(&[[-0.0, -0.0], [1.0, -0.0], [-0.0, 1.0]]).concat().into_iter().map(f64::to_bits);
    assert!(bits.into_iter().all(|bits| bits != (-0.0_f64).to_bits()));
}

#[test]
fn a_turned_rectangle_is_found() {
    let (sin, cos) = 0.4_f64.sin_cos();
    let turned = |s: f64, t: f64| [1.0 + cos * s - sin * t, 2.0 + sin * s + cos * t];
    let points: Vec<_> = (0..41)
        .flat_map(|i| (0..21).map(move |k| [0.05 * f64::from(i), 0.05 * f64::from(k)]))
        .map(|[s, t]| turned(s, t))
        .collect();
    let rectangle = minimum_area_rectangle(&points).unwrap();
    assert!((rectangle.lengths[0] - 2.0).abs() < 1e-12 && (rectangle.lengths[1] - 1.0).abs() < 1e-12);
    assert!((rectangle.axis[0] - cos).abs() < 1e-12 && (rectangle.axis[1] - sin).abs() < 1e-12);
    let center = turned(1.0, 0.5);
    assert!(
        (rectangle.center[0] - center[0]).abs() < 1e-12 && (rectangle.center[1] - center[1]).abs() < 1e-12
    );
    for (corner, expected) in
        rectangle.corners().into_iter().zip([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]])
    {
        let expected = turned(expected[0], expected[1]);
        assert!((corner[0] - expected[0]).abs() < 1e-12 && (corner[1] - expected[1]).abs() < 1e-12);
    }
}

/// Coordinates up to the limit neither overflow nor lose the rectangle.
#[test]
fn huge_and_tiny_coordinates_are_no_matter() {
    for scale in [1e-100, 1e-10, 1e10, 1e100] {
        let points =
            [[0.0, 0.0], [3.0, 4.0], [-1.0, 7.0], [-4.0, 3.0], [-0.5, 3.5]].map(|p| p.map(|x| x * scale));
        let rectangle = minimum_area_rectangle(&points).unwrap();
        assert!((rectangle.lengths[0] / scale - 5.0).abs() < 1e-12, "{rectangle:?}");
        assert!((rectangle.lengths[1] / scale - 5.0).abs() < 1e-12, "{rectangle:?}");
    }
}
