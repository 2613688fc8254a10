//! The box of least volume: against a dense search over all directions, and on shapes whose box is known.
#![allow(clippy::unwrap_used, reason = "tests")]

use dymlm_core::{Point, Pose, SplitMix64};
use dymlm_geometry::{
    BoxFit, OrientedBox, OrientedBoxScratch, fit_oriented_box, fit_oriented_box_with, minimum_area_rectangle,
};
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
/// smaller steps. It shares no code with what it tests but the rectangle, and cannot be below the least.
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

fn poses() -> impl Strategy<Value = Pose> {
    (prop::array::uniform4(-1.0..1.0_f64), prop::array::uniform3(-3.0..3.0_f64)).prop_filter_map(
        "no rotation",
        |(quaternion, translation)| {
            let norm = quaternion.iter().map(|q| q * q).sum::<f64>().sqrt();
            (norm > 0.1).then(|| Pose::new(translation, quaternion.map(|q| q / norm)).unwrap())
        },
    )
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
    #![proptest_config(ProptestConfig::with_cases(400))]

    #[test]
    fn no_search_finds_a_smaller_box(points in shapes()) {
        let (own, searched) = (minimal(&points).volume(), least_by_search(&points, 30));
        prop_assert!(own <= ALLOWED * searched, "{own} {searched} {}", own / searched);
    }
}
#[test]
fn stats() {
    use proptest::strategy::ValueTree;
    let mut runner = proptest::test_runner::TestRunner::deterministic();
    let n: usize = std::env::var("CASES").ok().and_then(|s| s.parse().ok()).unwrap_or(300);
    let mut r = Vec::new();
    let cases: Vec<_> = (0..n).map(|_| shapes().new_tree(&mut runner).unwrap().current()).collect();
    let cached: Vec<f64> = std::fs::read_to_string("/tmp/oracle.txt")
        .unwrap_or_default()
        .lines()
        .map(|l| l.parse().unwrap())
        .collect();
    let oracle: Vec<f64> = if cached.len() == n {
        cached
    } else {
        cases.iter().map(|points| least_by_search(points, 30)).collect()
    };
    std::fs::write("/tmp/oracle.txt", oracle.iter().map(|x| format!("{x}\n")).collect::<String>()).unwrap();
    let start = cpu();
    for (points, searched) in cases.iter().zip(oracle) {
        let own = minimal(points).volume();
        r.push((own / searched, points.len()));
    }
    println!("{:.3} ms each", (cpu() - start) / n as f64);
    r.sort_by(|a, b| a.0.total_cmp(&b.0));
    println!(
        "{} over .5%, {} over .1%, {} below -.1%, best {:?} worst {:?}",
        r.iter().filter(|x| x.0 > 1.005).count(),
        r.iter().filter(|x| x.0 > 1.001).count(),
        r.iter().filter(|x| x.0 < 0.999).count(),
        &r[..3],
        &r[r.len() - 8..]
    );
}

fn cloud(kind: &str, n: usize) -> Vec<Point> {
    let mut random = SplitMix64::new(7);
    let pose = Pose::new([1.0, 2.0, 1.0], [0.1, -0.5, 0.1, (1.0_f64 - 0.27).sqrt()]).unwrap();
    let points: Vec<Point> = (0..n)
        .map(|i| {
            let mut p = [0; 3].map(|_| 2.0 * random.fraction() as f32 - 1.0);
            match kind {
                "box" => {
                    p = [p[0] * 0.5, p[1] * 0.35, p[2] * 0.5 * 0.7];
                }
                "faces" => {
                    p[i % 3] = p[i % 3].signum() + 0.005 * (2.0 * random.fraction() as f32 - 1.0);
                    p = [p[0] * 0.5, p[1] * 0.35, p[2] * 0.25];
                }
                "ball" => {
                    while p.iter().map(|x| x * x).sum::<f32>() > 1.0 {
                        p = [0; 3].map(|_| 2.0 * random.fraction() as f32 - 1.0);
                    }
                }
                "sphere" => {
                    while p.iter().map(|x| x * x).sum::<f32>() > 1.0 {
                        p = [0; 3].map(|_| 2.0 * random.fraction() as f32 - 1.0);
                    }
                    let l = p.iter().map(|x| x * x).sum::<f32>().sqrt();
                    p = p.map(|x| x / l);
                }
                _ => {
                    p = [0; 3].map(|_| (0..12).map(|_| random.fraction() as f32).sum::<f32>() - 6.0);
                    p = [p[0], 0.6 * p[1], 0.3 * p[2]];
                }
            }
            p
        })
        .collect();
    moved(&points, &pose)
}

#[test]
fn timing() {
    let kinds = std::env::var("KINDS").unwrap_or("box,faces,ball,gauss,sphere".into());
    for kind in kinds.split(",") {
        let sizes = std::env::var("SIZES").unwrap_or("1000,100000,1000000".into());
        for n in sizes.split(",").map(|n| n.parse::<usize>().unwrap()) {
            if kind == "sphere" && n > 100_000 {
                continue;
            }
            let points = cloud(kind, n);
            let mut scratch = OrientedBoxScratch::default();
            let mut times = Vec::new();
            let mut volume = 0.0;
            for _ in 0..std::env::var("RUNS").ok().and_then(|s| s.parse().ok()).unwrap_or(9) {
                let start = cpu();
                volume =
                    fit_oriented_box_with(&points, BoxFit::MinimumVolume, &mut scratch).unwrap().volume();
                times.push(cpu() - start);
            }
            times.sort_by(f64::total_cmp);
            let start = cpu();
            let principal = fit_oriented_box(&points, BoxFit::PrincipalAxes).unwrap().volume();
            println!(
                "{kind} {n}: {:.3} ms median, {:.3} min, volume {volume:.5} ({principal:.5} principal, {:.3} ms)",
                times[times.len() / 2],
                times[0],
                cpu() - start
            );
        }
    }
}

fn cpu() -> f64 {
    std::fs::read_to_string("/proc/thread-self/schedstat")
        .unwrap()
        .split(' ')
        .next()
        .unwrap()
        .parse::<f64>()
        .unwrap()
        * 1e-6
}
