//! The box of least volume: against a dense search over all directions, and on shapes whose box is known.
use crate::common::poses;
use dymlm_core::{Point, Pose, SplitMix64};
use dymlm_geometry::{
    BoxFit, OrientedBox, OrientedBoxScratch, fit_oriented_box, fit_oriented_box_with, minimum_area_rectangle,
};
use dymlm_test_support::cases;
use proptest::prelude::*;

type Vector = [f64; 3];

/// How much larger than the least a box may be.
const ALLOWED: f64 = 1.005;

fn minimal(points: &[Point]) -> OrientedBox {
    fit_oriented_box(points, BoxFit::MinimumVolume).unwrap()
}

fn dot(a: Vector, b: Vector) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn unit(a: Vector) -> Vector {
    let length = dot(a, a).sqrt();
    a.map(|x| x / length)
}

/// The least volume of a box with one axis given: the extent along it, times the footprint's least rectangle.
fn least_about(points: &[Point], axis: Vector) -> f64 {
    let across = unit(if axis[0].abs() > 0.5 { [-axis[1], axis[0], 0.0] } else { [0.0, -axis[2], axis[1]] });
    let third = cross(axis, across);
    let place = |point: &Point| point.map(f64::from);
    let footprint: Vec<[f64; 2]> =
        points.iter().map(|point| [dot(place(point), across), dot(place(point), third)]).collect();
    let heights = || points.iter().map(|point| dot(place(point), axis));
    let height = heights().fold(f64::NEG_INFINITY, f64::max) - heights().fold(f64::INFINITY, f64::min);
    height * minimum_area_rectangle(&footprint).unwrap().area()
}

/// The least volume by brute force: all directions of a lattice, and the best of them turned further in ever
/// smaller steps. It shares only the rectangle's code with what it tests, and cannot be below the least
/// volume.
fn least_by_search(points: &[Point], per_side: i32) -> f64 {
    const REFINED: usize = 30;
    let step = 2.0 / f64::from(per_side);
    let mut found = Vec::new();
    for axis in 0..3 {
        for (i, j) in (0..per_side).flat_map(|i| (0..per_side).map(move |j| (i, j))) {
            let mut direction = [0.0; 3];
            direction[axis] = 1.0;
            direction[(axis + 1) % 3] = step * (f64::from(i) + 0.5) - 1.0;
            direction[(axis + 2) % 3] = step * (f64::from(j) + 0.5) - 1.0;
            let direction = unit(direction);
            found.push((least_about(points, direction), direction));
        }
    }
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    found.truncate(REFINED);
    found.into_iter().map(|start| refined(points, start, step)).fold(f64::INFINITY, f64::min)
}

fn refined(points: &[Point], (mut least, mut direction): (f64, Vector), step: f64) -> f64 {
    let mut step = step;
    while step > 1e-5 {
        let across = unit(if direction[0].abs() > 0.5 {
            [-direction[1], direction[0], 0.0]
        } else {
            [0.0, -direction[2], direction[1]]
        });
        let third = cross(direction, across);
        let around = (0..12).map(|k| {
            let (sin, cos) = (f64::from(k) * std::f64::consts::PI / 6.0).sin_cos();
            unit([0, 1, 2].map(|i| direction[i] + step * (cos * across[i] + sin * third[i])))
        });
        let best = around
            .map(|other| (least_about(points, other), other))
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .unwrap();
        if best.0 < least {
            (least, direction) = best;
        } else {
            step *= 0.5;
        }
    }
    least
}

fn moved(points: &[Point], by: &Pose) -> Vec<Point> {
    points.iter().map(|point| by.transform_point(point.map(f64::from)).map(|x| x as f32)).collect()
}

/// Random points: in a ball, in a box, on a cylinder, near the axes of a cross; of one size or stretched.
fn shapes() -> impl Strategy<Value = Vec<Point>> {
    let unit_points =
        |count: std::ops::Range<usize>| prop::collection::vec(prop::array::uniform3(-1.0..1.0_f32), count);
    let ball = unit_points(8..40).prop_map(|points| {
        points
            .into_iter()
            .map(|p| {
                let n = p.iter().map(|x| x * x).sum::<f32>().sqrt().max(0.1);
                p.map(|x| x / n)
            })
            .collect::<Vec<Point>>()
    });
    let cylinder = unit_points(8..40).prop_map(|points| {
        points
            .into_iter()
            .map(|[x, y, z]| {
                let n = x.hypot(y).max(0.1);
                [x / n, y / n, z.signum()]
            })
            .collect::<Vec<Point>>()
    });
    let spikes = unit_points(6..20).prop_map(|points| {
        points
            .into_iter()
            .enumerate()
            .map(|(i, mut p)| {
                p[i % 3] *= 4.0;
                p
            })
            .collect::<Vec<Point>>()
    });
    let stretch = prop_oneof![
        Just([1.0, 1.0, 1.0]),
        Just([1.0, 0.7, 0.4]),
        Just([1.0, 0.3, 0.05]),
        Just([1.0, 0.9, 0.02])
    ];
    let any = prop_oneof![unit_points(4..8), unit_points(8..40), ball, cylinder, spikes];
    (any, stretch, poses()).prop_map(|(points, stretch, pose)| {
        let stretched: Vec<Point> = points.iter().map(|p| [0, 1, 2].map(|k| p[k] * stretch[k])).collect();
        moved(&stretched, &pose)
    })
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(12)))]

    #[test]
    fn no_search_finds_a_smaller_box(points in shapes()) {
        let (own, searched) = (minimal(&points).volume(), least_by_search(&points, 30));
        prop_assert!(own <= ALLOWED * searched, "{own} {searched} {}", own / searched);
    }
}

/// Clouds with the same hull as a shape, and so many points inside it that inner points are dropped first.
fn filled(shape: &[Point], count: usize, seed: u64) -> Vec<Point> {
    let mut random = SplitMix64::new(seed);
    let mut between = || {
        let corners = [0; 3].map(|_| shape[random.below(shape.len())]);
        let shares = [random.fraction() as f32, random.fraction() as f32];
        let mix = |a: f32, b: f32, share: f32| a + share * (b - a);
        [0, 1, 2].map(|k| mix(mix(corners[0][k], corners[1][k], shares[0]), corners[2][k], shares[1]))
    };
    let mut points: Vec<Point> = (0..count).map(|_| between()).collect();
    for (index, corner) in shape.iter().enumerate() {
        points.insert(index * count / shape.len(), *corner);
    }
    points
}

/// The greatest volume that a box of points may have when these are rounded, and so may lie just outside: for
/// a sheet 3 um thick that is 2 %.
fn rounded(own: &OrientedBox, points: &[Point]) -> f64 {
    let farthest = points.iter().flatten().fold(0.0_f32, |most, c| most.max(c.abs()));
    let rounding = 2.0 * f64::from(f32::EPSILON * farthest);
    own.lengths().iter().map(|length| length + rounding).product()
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(40)))]

    #[test]
    fn points_inside_do_not_matter(shape in shapes(), count in 2_100..20_000_usize, seed in 0..1000_u64) {
        let (bare, full) = (minimal(&shape), minimal(&filled(&shape, count, seed)));
        // A line has hardly a volume without the points between its corners.
        let most = rounded(&bare, &shape);
        let is_between = bare.volume() <= ALLOWED * full.volume() && full.volume() <= ALLOWED * most;
        prop_assert!(is_between, "{} {}", full.volume(), bare.volume());
    }

    #[test]
    fn neither_motion_nor_order_nor_repetition_matter(shape in shapes(), pose in poses(), seed in 0..1000_u64) {
        let mut random = SplitMix64::new(seed);
        let mut there = moved(&shape, &pose);
        for place in (1..there.len()).rev() {
            there.swap(place, random.below(place + 1));
        }
        there.extend_from_within(..there.len() / 2);
        let boxes = [minimal(&shape), minimal(&there)];
        let [here, there_volume] = boxes.map(|own| own.volume());
        let [most_here, most_there] = boxes.map(|own| rounded(&own, &there));
        let is_same = there_volume <= ALLOWED * most_here && here <= ALLOWED * most_there;
        prop_assert!(is_same, "{here} {there_volume}");
    }

    #[test]
    fn no_other_fit_is_smaller(shape in shapes(), up in prop::array::uniform3(-1.0..1.0_f64)) {
        let own = minimal(&shape).volume();
        for fit in [BoxFit::PrincipalAxes, BoxFit::MinimumRectangle, BoxFit::Upright { up }] {
            let other = fit_oriented_box(&shape, fit).unwrap().volume();
            prop_assert!(own <= ALLOWED * other, "{own} {other} {fit:?}");
        }
    }

    #[test]
    fn kept_memory_gives_the_same_bits(clouds in prop::collection::vec((shapes(), prop_oneof![Just(0), Just(5000_usize)]), 2..4)) {
        let mut scratch = OrientedBoxScratch::default();
        for (shape, count) in clouds {
            let points = filled(&shape, count, 1);
            let kept = fit_oriented_box_with(&points, BoxFit::MinimumVolume, &mut scratch);
            prop_assert_eq!(kept, fit_oriented_box(&points, BoxFit::MinimumVolume));
        }
    }

    /// The box of points at the corners of a turned box, on its faces or all through it is that box.
    #[test]
    fn a_turned_box_is_found(
        lengths in prop::array::uniform3(0.05..2.0_f32),
        pose in poses(),
        count in prop_oneof![Just(0_usize), Just(500), Just(6000)],
        on_faces in any::<bool>(),
    ) {
        let mut random = SplitMix64::new(3);
        let mut points: Vec<Point> = (0..8).map(|k| [0, 1, 2].map(|axis| (k >> axis & 1) as f32)).collect();
        points.extend((0..count).map(|i| {
            let mut point = [0; 3].map(|_| random.fraction() as f32);
            if on_faces {
                point[i % 3] = point[i % 3].round();
            }
            point
        }));
        let points: Vec<Point> = points.iter().map(|p| [0, 1, 2].map(|k| (p[k] - 0.5) * lengths[k])).collect();
        let own = minimal(&moved(&points, &pose));
        let mut expected = lengths.map(f64::from);
        expected.sort_by(|a, b| b.total_cmp(a));
        for (length, expected) in own.lengths().into_iter().zip(expected) {
            prop_assert!((length - expected).abs() < 2e-5, "{:?} {expected:?}", own.lengths());
        }
        prop_assert!((0..3).all(|axis| (own.center()[axis] - pose.translation()[axis]).abs() < 2e-5));
    }
}

/// The least box of a regular tetrahedron is the cube whose face diagonals are its edges: no side of the cube
/// lies on a face. A box with a side on a face has twice the volume.
#[test]
fn the_box_of_a_tetrahedron_is_a_cube() {
    let corners: [Point; 4] = [[1.0, 1.0, 1.0], [1.0, -1.0, -1.0], [-1.0, 1.0, -1.0], [-1.0, -1.0, 1.0]];
    let mut random = SplitMix64::new(4);
    for _ in 0..200 {
        let quaternion = [0; 4].map(|_| random.fraction() - 0.5);
        let norm = quaternion.iter().map(|q| q * q).sum::<f64>().sqrt();
        let pose = Pose::new([0.3, -0.2, 5.0], quaternion.map(|q| q / norm)).unwrap();
        let own = minimal(&moved(&corners, &pose));
        assert!(own.lengths().iter().all(|length| (length - 2.0).abs() < 1e-3), "{:?}", own.lengths());
    }
}

#[test]
fn a_ball_has_a_box_of_its_diameter() {
    let mut random = SplitMix64::new(5);
    let mut points = Vec::new();
    while points.len() < 30_000 {
        let point = [0; 3].map(|_| 2.0 * random.fraction() as f32 - 1.0);
        if point.iter().map(|x| x * x).sum::<f32>() <= 1.0 {
            points.push(point);
        }
    }
    let on_sphere: Vec<Point> = points
        .iter()
        .take(5000)
        .map(|p| {
            let norm = p.iter().map(|x| x * x).sum::<f32>().sqrt();
            p.map(|x| x / norm)
        })
        .collect();
    for cloud in [points, on_sphere] {
        let own = minimal(&cloud);
        assert!(own.lengths().iter().all(|length| (1.93..=2.000_01).contains(length)), "{:?}", own.lengths());
        assert!(cloud.iter().all(|point| own.contains(point.map(f64::from))));
    }
}

/// The sample that is taken first, some points of every few hundred, may say nothing about the other points.
#[test]
fn a_sample_may_mislead() {
    let mut random = SplitMix64::new(6);
    let lengths = [3.0, 2.0, 1.0];
    let mut points: Vec<Point> =
        (0..20_000).map(|_| lengths.map(|length| length * random.fraction() as f32)).collect();
    points.extend((0..8).map(|k| [0, 1, 2].map(|axis| (k >> axis & 1) as f32 * lengths[axis])));
    for flat_share in [0, 16, 500] {
        // Of every 512 points the first few lie in a plane, at one place, or beside a NaN.
        for kind in 0..3 {
            let mut cloud = points.clone();
            for (index, point) in cloud.iter_mut().take(19_968).enumerate() {
                if index % 512 < flat_share {
                    match kind {
                        0 => point[2] = 0.5,
                        1 => *point = [1.0; 3],
                        _ => point[0] = f32::NAN,
                    }
                }
            }
            let own = minimal(&cloud);
            assert!((own.volume() - 6.0).abs() < 1e-3, "{flat_share} {kind} {}", own.volume());
        }
    }
}

#[test]
fn flat_clouds_have_flat_boxes_and_far_ones_none() {
    let line: Vec<Point> = (0..5000).map(|i| [0.001 * i as f32, 0.002 * i as f32, 0.0]).collect();
    let plane: Vec<Point> = (0..5000).map(|i| [(i % 100) as f32, (i / 100) as f32, 3.0]).collect();
    for cloud in [line, plane, vec![[1.0, 2.0, 3.0]; 5000], vec![[1.0, 2.0, 3.0]]] {
        let own = minimal(&cloud);
        assert!(own.volume() < 1e-6, "{own:?}");
        assert_eq!(Some(own), fit_oriented_box(&cloud, BoxFit::MinimumRectangle));
        assert!(cloud.iter().all(|point| own.contains(point.map(f64::from))));
    }
    let corners = |size: f32, at: f32| -> Vec<Point> {
        (0..8).map(|k| [0, 1, 2].map(|axis| at + size * (k >> axis & 1) as f32)).collect()
    };
    assert_eq!(fit_oriented_box(&[], BoxFit::MinimumVolume), None);
    assert_eq!(fit_oriented_box(&vec![[f32::NAN; 3]; 3000], BoxFit::MinimumVolume), None);
    assert_eq!(fit_oriented_box(&corners(f32::MAX, 0.0), BoxFit::MinimumVolume), None);
    for (size, at) in [(1e14, 0.0), (1e-12, 0.0), (1.0, 4096.0), (1e-20, 0.0), (1e-40, 0.0)] {
        let own = minimal(&corners(size, at));
        let expected = f64::from(at + size) - f64::from(at);
        assert!(own.lengths().iter().all(|length| (length / expected - 1.0).abs() < 1e-5), "{own:?}");
    }
}
