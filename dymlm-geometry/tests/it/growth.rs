//! Clouds that are made to be slow take no longer than others: shown by how the time grows from one size to
//! eight times that size.
use dymlm_core::{Point, SplitMix64};
use dymlm_geometry::{
    BoxFit, Dbscan, DbscanConfig, StatisticalOutlierConfig, StatisticalOutlierRemoval, fit_oriented_box,
};
use dymlm_test_support::growth;

const SMALL: usize = 2_000;
/// Used where spheres cut through crowds: below this size, the time grows faster than for large clouds.
const SMALL_WHERE_CUT: usize = 8_000;
const TIMES: usize = 8;
/// n log n is 10.2 from one size to the other, n² 64.
const MOST: f64 = 24.0;
/// Where spheres of eps cut through crowds, and where cells are full of points slightly too far from those of
/// another cell: no algorithm below n^(4/3) is known, and boxes take up to n^(3/2) log n, which is 32.
const MOST_WHERE_CUT: f64 = 45.0;

/// A cloud of each of the two sizes.
fn pair(cloud: impl Fn(usize) -> Vec<Point>) -> [Vec<Point>; 2] {
    [SMALL, TIMES * SMALL].map(cloud)
}

fn large_pair(cloud: impl Fn(usize) -> Vec<Point>) -> [Vec<Point>; 2] {
    [SMALL_WHERE_CUT, TIMES * SMALL_WHERE_CUT].map(cloud)
}

/// Random points in a cube of side 1, `scale` times as large and moved.
fn scattered(n: usize, scale: f32, offset: f32) -> Vec<Point> {
    let mut random = SplitMix64::new(5);
    (0..n).map(|_| [0; 3].map(|_| offset + scale * random.fraction() as f32)).collect()
}

/// Clouds whose points squared distances do not tell apart, or with many points at one spot.
fn crowds() -> Vec<(&'static str, [Vec<Point>; 2])> {
    vec![
        ("equal", pair(|n| vec![[1.0, 2.0, 3.0]; n])),
        ("two places", pair(|n| (0..n).map(|i| [(i % 2) as f32 * 0.03, 0.0, 1.0]).collect())),
        ("pairs", pair(|n| (0..n).map(|i| [0.001 * (i / 2) as f32, 0.0, 1.0]).collect())),
        ("hundreds of places", pair(|n| scattered(300, 1.0, 0.0).into_iter().cycle().take(n).collect())),
        ("denormal", pair(|n| scattered(n, 1e-39, 0.0))),
        ("squares are denormal", pair(|n| scattered(n, 1e-22, 0.0))),
        ("squares vanish between tiny numbers", pair(|n| scattered(n, 1e-24, 1e-18))),
        (
            "denormal, and one far away",
            pair(|n| [scattered(n - 1, 1e-39, 0.0), vec![[1e3, 0.0, 0.0]]].concat()),
        ),
        ("far from the origin", pair(|n| scattered(n, 0.5, 4e6))),
        ("a line along an axis", pair(|n| (0..n).map(|i| [0.0, 0.0, 0.01 * i as f32]).collect())),
    ]
}

#[test]
fn outlier_removal_takes_n_log_n_on_crowds() {
    let removal = StatisticalOutlierRemoval::new(StatisticalOutlierConfig::default()).unwrap();
    let mut slow = Vec::new();
    for (name, [small, large]) in crowds() {
        let times = growth(MOST, &small, &large, |points| removal.apply(points));
        if times > MOST {
            slow.push(format!("{name}: {times:.0} times"));
        }
    }
    assert!(slow.is_empty(), "{slow:?}");
}

/// Two slanted sheets whose distance is slightly more than `eps`, both crowded.
fn sheets(n: usize, eps: f32) -> Vec<Point> {
    let mut random = SplitMix64::new(8);
    let normal = [2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0];
    let across = [[1.0 / 3.0, -2.0 / 3.0, 2.0 / 3.0], [-2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0]];
    let mut point = |i: usize| {
        let [a, b] = [0; 2].map(|_| 0.2 * eps * random.fraction() as f32);
        let side = (i % 2) as f32 * eps * 1.0005;
        std::array::from_fn(|axis| a * across[0][axis] + b * across[1][axis] + side * normal[axis])
    };
    (0..n).map(&mut point).collect()
}

/// Name, clouds, and the number of neighbours to ask for.
type Case<'a> = (&'a str, [Vec<Point>; 2], &'a (dyn Fn(usize) -> usize + Sync));

/// Greatest distance of neighbours, metres.
const EPS: f32 = 0.05;

#[test]
fn dbscan_does_not_compare_all_pairs_of_a_crowd() {
    let half_apart = |n: usize| -> Vec<Point> {
        (0..n).map(|i| [if i % 2 == 0 { 0.0 } else { 0.052 }, 0.0, 1.0]).collect()
    };
    let ball = |n: usize| -> Vec<Point> {
        scattered(3 * n, 1.0, -0.5)
            .into_iter()
            .filter(|p| p.iter().map(|x| x * x).sum::<f32>() <= 0.25)
            .map(|p| p.map(|x| EPS * x))
            .take(n)
            .collect()
    };
    // Two cells with points at two places each, at least 5.1 cm from those of the other cell; the boxes around
    // the points of the cells are 4.7 cm apart.
    let corners = |n: usize| -> Vec<Point> {
        let places = [[0.0, 0.0, 0.0], [0.02, 0.02, 0.0], [0.035, 0.0, 0.045], [0.055, 0.02, 0.045]];
        (0..n).map(|i| places[i % 4]).collect()
    };
    let found = Dbscan::new(DbscanConfig::default()).unwrap().cluster(&corners(400));
    assert_eq!(found.sizes(), [200, 200], "the cells do not touch");
    let huge = |_: usize| 1_000_000_000;
    assert_growth(
        MOST,
        &[
            ("within eps, more neighbours asked for than there are", pair(ball), &huge),
            ("within eps, all asked for", pair(ball), &|n| n),
            ("equal, more asked for", pair(|n| vec![[1.0; 3]; n]), &huge),
            ("two places, almost half asked for", pair(half_apart), &|n| n / 2),
            ("two places, more than half asked for", pair(half_apart), &|n| n / 2 + 1),
            ("corners of cells", pair(corners), &|_| 10),
        ],
    );
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn dbscan_does_not_compare_all_pairs_where_spheres_cut_through_crowds() {
    assert_growth(
        MOST_WHERE_CUT,
        &[
            ("a cube, half asked for", large_pair(|n| scattered(n, 0.08, 0.0)), &|n| n / 2),
            ("a cube, some asked for", large_pair(|n| scattered(n, 0.15, 0.0)), &|n| n / 10),
            ("sheets", large_pair(|n| sheets(n, EPS)), &|_| 10),
            ("sheets, many asked for", large_pair(|n| sheets(n, EPS)), &|n| n / 4),
        ],
    );
}

/// The time that clusters take grows at most so many times from the small cloud to the large one of each
/// case.
fn assert_growth(most: f64, cases: &[Case<'_>]) {
    let mut slow = Vec::new();
    for (name, [small, large], min_points) in cases {
        let times = growth(most, small, large, |points| {
            let mut config = DbscanConfig::default();
            (config.eps, config.min_points) = (EPS, min_points(points.len()));
            Dbscan::new(config).unwrap().cluster(points)
        });
        if times > most {
            slow.push(format!("{name}: {times:.0} times"));
        }
    }
    assert!(slow.is_empty(), "{slow:?}");
}

#[test]
fn the_box_of_least_volume_takes_n_log_n() {
    let normalized = |p: Point| {
        let norm = p.iter().map(|x| x * x).sum::<f32>().sqrt();
        p.map(|x| x / norm)
    };
    let sphere = |n: usize| scattered(n, 1.0, -0.5).into_iter().map(normalized).collect();
    let faces = |n: usize| {
        let on_face = |(i, mut p): (usize, Point)| {
            p[i % 3] = (p[i % 3] - 0.2).signum() + 0.01 * p[i % 3];
            p
        };
        scattered(n, 1.0, -0.5).into_iter().enumerate().map(on_face).collect()
    };
    // The points sampled first are in one plane, so nothing is known to be inside.
    let flat_first = |n: usize| {
        let mut points = scattered(n, 1.0, -0.5);
        points.iter_mut().enumerate().filter(|(i, _)| i % 512 < 100).for_each(|(_, p)| p[2] = 0.0);
        points
    };
    let clouds: [(&str, [Vec<Point>; 2]); 4] = [
        ("a sphere", large_pair(sphere)),
        ("faces of a box", large_pair(faces)),
        ("the first of each span in a plane", large_pair(flat_first)),
        (
            "half of all at one place",
            large_pair(|n| [scattered(n / 2, 1.0, 0.0), vec![[0.5; 3]; n / 2]].concat()),
        ),
    ];
    let mut slow = Vec::new();
    for (name, [small, large]) in clouds {
        let times = growth(MOST, &small, &large, |points| fit_oriented_box(points, BoxFit::MinimumVolume));
        if times > MOST {
            slow.push(format!("{name}: {times:.0} times"));
        }
    }
    assert!(slow.is_empty(), "{slow:?}");
}
