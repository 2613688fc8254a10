//! DBSCAN against the definition, against scikit-learn, and on degenerate clouds.
use crate::common::{data, golden_points};
use dymlm_core::Point;
use dymlm_geometry::{Clusters, Dbscan, DbscanConfig, DbscanScratch};
use dymlm_test_support::{cases, shuffle};
use proptest::prelude::*;

fn dbscan(eps: f32, min_points: usize) -> Dbscan {
    let mut config = DbscanConfig::default();
    config.eps = eps;
    config.min_points = min_points;
    Dbscan::new(config).unwrap()
}

/// The documented rules, pair by pair.
fn by_definition(points: &[Point], eps: f32, min_points: usize) -> Vec<Option<u32>> {
    let near = |a: usize, b: usize| {
        let [dx, dy, dz]: Point = std::array::from_fn(|axis| points[a][axis] - points[b][axis]);
        points[a].iter().chain(&points[b]).all(|x| x.is_finite()) && dx * dx + dy * dy + dz * dz <= eps * eps
    };
    let all = 0..points.len();
    let neighbors: Vec<Vec<usize>> =
        all.clone().map(|a| all.clone().filter(|&b| near(a, b)).collect()).collect();
    let core: Vec<bool> = neighbors.iter().map(|near| near.len() >= min_points).collect();
    let mut labels = vec![None; points.len()];
    let mut next = 0;
    for first in all.filter(|&first| core[first]) {
        if labels[first].is_some() {
            continue;
        }
        let mut open = vec![first];
        labels[first] = Some(next);
        while let Some(a) = open.pop() {
            for &b in neighbors[a].iter().filter(|&&b| core[b]) {
                if labels[b].is_none() {
                    labels[b] = Some(next);
                    open.push(b);
                }
            }
        }
        next += 1;
    }
    let of_core = labels.clone();
    for border in (0..points.len()).filter(|&border| !core[border]) {
        labels[border] = neighbors[border].iter().filter(|&&b| core[b]).filter_map(|&b| of_core[b]).min();
    }
    labels
}

/// Checks all that [`Clusters`] tells against its labels.
fn assert_consistent(clusters: &Clusters) {
    for (label, &size) in (0..).zip(clusters.sizes()) {
        assert!(size > 0);
        assert_eq!(clusters.members(label).count(), size);
    }
    assert_eq!(clusters.count(), clusters.sizes().len());
    assert_eq!(clusters.members(clusters.count() as u32).count(), 0);
    assert_eq!(clusters.noise(), clusters.labels().iter().filter(|label| label.is_none()).count());
    match clusters.largest() {
        Some(largest) => assert_eq!(clusters.sizes().iter().max(), clusters.sizes().get(largest as usize)),
        None => assert_eq!(clusters.count(), 0),
    }
}

/// Clouds of several densities: uniform, on a lattice whose distances equal eps, in planes, with duplicates.
fn clouds() -> impl Strategy<Value = Vec<Point>> {
    let uniform = |side: f32| prop::array::uniform3(-side..side);
    let on_lattice = prop::array::uniform3(-3..3_i8).prop_map(|cell| cell.map(|i| 0.25 * f32::from(i)));
    let on_plane = [-1.0..1.0_f32, -1.0..1.0].prop_map(|[u, v]| [u, v, 0.5]);
    prop_oneof![
        prop::collection::vec(uniform(1.0), 0..300),
        prop::collection::vec(uniform(0.3), 0..300),
        prop::collection::vec(on_lattice.clone(), 0..300),
        prop::collection::vec(on_plane.clone(), 0..400),
        prop::collection::vec(prop_oneof![uniform(1.0), on_lattice, on_plane], 0..300),
    ]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(80)))]

    #[test]
    fn equals_the_definition(points in clouds(), eps in prop_oneof![Just(0.25_f32), 0.02..0.8_f32], min_points in 1..20_usize) {
        let clusters = dbscan(eps, min_points).cluster(&points);
        assert_consistent(&clusters);
        prop_assert_eq!(clusters.labels(), by_definition(&points, eps, min_points));
    }

    /// Far from the origin steps of f32 come near to eps, and beyond 2^26 cells indices turn into ranks.
    #[test]
    fn equals_the_definition_far_away(
        points in prop::collection::vec(prop::array::uniform3(-6..6_i8), 0..150),
        exponent in 0..120_i32,
        spread in 0..3_usize,
        min_points in 1..6_usize,
    ) {
        let eps = 0.5;
        let far = 2.0_f32.powi(exponent);
        let step = [0.25, far * f32::EPSILON, far][spread];
        let points: Vec<Point> =
            points.iter().map(|p| [far + step * f32::from(p[0]), step * f32::from(p[1]), -far - step * f32::from(p[2])]).collect();
        let clusters = dbscan(eps, min_points).cluster(&points);
        prop_assert_eq!(clusters.labels(), by_definition(&points, eps, min_points));
    }

    #[test]
    fn skips_points_that_are_not_finite(points in clouds(), holes in prop::collection::vec((0..400_usize, 0..3_usize, 0..3_usize), 1..40)) {
        let mut points = points;
        for (index, axis, kind) in holes {
            if let Some(point) = points.get_mut(index) {
                point[axis] = [f32::NAN, f32::INFINITY, f32::NEG_INFINITY][kind];
            }
        }
        let clusters = dbscan(0.25, 4).cluster(&points);
        prop_assert_eq!(clusters.labels(), by_definition(&points, 0.25, 4));
    }

    /// Another order of the points renumbers clusters and may move border points, but divides core points and
    /// noise in the same way.
    #[test]
    fn order_does_not_matter_to_core_points(points in clouds(), seed in any::<u64>()) {
        let (eps, min_points) = (0.25, 5);
        let mut order: Vec<usize> = (0..points.len()).collect();
        shuffle(&mut order, seed);
        let shuffled: Vec<Point> = order.iter().map(|&i| points[i]).collect();
        let (before, after) = (dbscan(eps, min_points).cluster(&points), dbscan(eps, min_points).cluster(&shuffled));
        prop_assert_eq!(before.count(), after.count());
        prop_assert_eq!(before.noise(), after.noise());
        let core = |i: usize| {
            let near = |b: &&Point| {
                let [dx, dy, dz]: Point = std::array::from_fn(|axis| points[i][axis] - b[axis]);
                dx * dx + dy * dy + dz * dz <= eps * eps
            };
            points.iter().filter(near).count() >= min_points
        };
        let mut renumbered = vec![None; before.count()];
        for (place, &i) in order.iter().enumerate() {
            let (old, new) = (before.labels()[i], after.labels()[place]);
            prop_assert_eq!(old.is_some(), new.is_some());
            if let (Some(old), true) = (old, core(i)) {
                prop_assert_eq!(*renumbered[old as usize].get_or_insert(new), new);
            }
        }
    }

    /// A quarter turn and a shift by a power of two change no rounding here, so that the labels stay as they
    /// are.
    #[test]
    fn moved_clouds_have_the_same_labels(points in prop::collection::vec(prop::array::uniform3(-64..64_i8), 0..300)) {
        let points: Vec<Point> = points.iter().map(|p| p.map(|x| f32::from(x) / 64.0)).collect();
        let moved: Vec<Point> = points.iter().map(|&[x, y, z]| [16.0 - y, x - 8.0, z + 32.0]).collect();
        let dbscan = dbscan(0.2, 5);
        prop_assert_eq!(dbscan.cluster(&points), dbscan.cluster(&moved));
    }

    #[test]
    fn buffers_carry_nothing_over(first in clouds(), second in clouds()) {
        let dbscan = dbscan(0.2, 6);
        let (mut scratch, mut clusters) = (DbscanScratch::default(), Clusters::default());
        for points in [&first, &second, &first] {
            dbscan.cluster_into(points, &mut scratch, &mut clusters);
            prop_assert_eq!(&clusters, &dbscan.cluster(points));
        }
    }
}

/// Points in a ball, in few places, or in two slanted heaps that just touch or just do not.
fn crowds() -> impl Strategy<Value = Vec<Point>> {
    let heaps = (0.04..0.06_f32, any::<bool>()).prop_flat_map(|(distance, is_even)| {
        let place = (0..2_u8, prop::array::uniform2(0.0..0.01_f32));
        prop::collection::vec(place, 1100..1500).prop_map(move |places| {
            let bend = |u: f32, v: f32| if is_even { 0.3 * u } else { 0.3 * u + 20.0 * u * v };
            places.iter().map(|&(side, [u, v])| [u, v, bend(u, v) + distance * f32::from(side)]).collect()
        })
    });
    let sites = prop::collection::vec(prop::array::uniform3(0.0..0.1_f32), 2..30);
    let in_few_places = (sites, prop::collection::vec(0..30_usize, 600..1500))
        .prop_map(|(sites, chosen)| chosen.iter().map(|&i| sites[i % sites.len()]).collect());
    let scattered = (0.02..0.15_f32, prop::collection::vec(prop::array::uniform3(0.0..1.0_f32), 600..1500))
        .prop_map(|(side, points)| {
            points.into_iter().map(|point| point.map(|x| side * x)).collect::<Vec<Point>>()
        });
    prop_oneof![heaps, in_few_places, scattered]
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(cases(12)))]

    /// For a large `min_points`, and in crowded cells, boxes are compared instead of points.
    #[test]
    fn equals_the_definition_on_crowds(
        points in crowds(),
        min_points in prop_oneof![5..20_usize, 513..900_usize, Just(1_000_000_000)],
    ) {
        let clusters = dbscan(0.05, min_points).cluster(&points);
        assert_consistent(&clusters);
        prop_assert_eq!(clusters.labels(), by_definition(&points, 0.05, min_points));
    }
}

/// `tests/data/make_golden.py` made the points and scikit-learn's labels.
#[test]
fn equals_scikit_learn() {
    let points = golden_points();
    assert_eq!(points.len(), 1500);
    let golden = data("dbscan_labels.csv");
    assert_eq!(golden.lines().count(), 6);
    for line in golden.lines() {
        let mut fields = line.split(',');
        let eps = fields.next().unwrap().parse().unwrap();
        let min_points = fields.next().unwrap().parse().unwrap();
        let expected: Vec<Option<u32>> = fields.map(|label| label.parse().ok()).collect();
        assert_eq!(
            dbscan(eps, min_points).cluster(&points).labels(),
            expected,
            "eps {eps}, {min_points} points"
        );
    }
}

#[test]
fn degenerate_clouds_have_plain_answers() {
    let three = dbscan(0.1, 3);
    assert_eq!(three.cluster(&[]), Clusters::default());
    assert_eq!(three.cluster(&[[1.0; 3]]).labels(), [None]);
    assert_eq!(three.cluster(&[[f32::NAN; 3]; 5]).labels(), [None; 5]);
    assert_eq!(three.cluster(&[[0.3, -7.0, 1e30]; 3]).labels(), [Some(0); 3]);
    assert_eq!(three.cluster(&[[1.0; 3]; 2]).labels(), [None; 2]);
    assert_eq!(dbscan(0.1, 1).cluster(&[[0.0; 3], [f32::MAX; 3], [f32::MIN; 3]]).count(), 3);

    let line: Vec<Point> = (0..50).map(|i| [0.0625 * i as f32, 0.0, 0.0]).collect();
    // The ends have two neighbours each.
    assert_eq!(dbscan(0.0625, 3).cluster(&line).sizes(), [50]);
    assert_eq!(dbscan(0.0625, 4).cluster(&line).count(), 0);
    assert_eq!(dbscan(0.0624, 2).cluster(&line).count(), 0);
}

/// A crowded cell, and two crowded cells that just fail to touch.
#[test]
fn crowded_cells_meet_at_eps_and_not_beyond() {
    let crowd = |x: f32| (0..2000_u16).map(move |i| [x, f32::from(i % 50) * 1e-4, f32::from(i / 50) * 1e-4]);
    let pair = |gap: f32| crowd(0.0).chain(crowd(gap)).collect::<Vec<Point>>();
    let dbscan = dbscan(0.125, 10);
    assert_eq!(dbscan.cluster(&crowd(0.3).collect::<Vec<_>>()).sizes(), [2000]);
    assert_eq!(dbscan.cluster(&pair(0.125)).sizes(), [4000]);
    assert_eq!(dbscan.cluster(&pair(0.125_f32.next_up())).sizes(), [2000, 2000]);
}

/// A border point within eps of two clusters belongs to the one with the lower number, wherever it stands in
/// the cloud.
#[test]
fn border_points_go_to_the_first_cluster() {
    let left = [[0.0, 0.0, 0.0], [-0.25, 0.0, 0.0], [0.0, 0.25, 0.0]];
    let right = [[1.0, 0.0, 0.0], [1.25, 0.0, 0.0], [1.0, 0.25, 0.0]];
    let between = [[0.5, 0.0, 0.0]];
    let labels = |parts: [&[Point]; 3]| dbscan(0.5, 4).cluster(&parts.concat()).labels().to_vec();
    let (zero, one) = ([Some(0); 3], [Some(1); 3]);
    assert_eq!(labels([&left, &right, &between]), [&zero[..], &one, &[Some(0)]].concat());
    assert_eq!(labels([&right, &left, &between]), [&zero[..], &one, &[Some(0)]].concat());
    assert_eq!(labels([&between, &right, &left]), [&[Some(0)], &zero[..], &one].concat());
}

#[test]
fn refuses_settings_out_of_range() {
    let refused = |eps: f32, min_points: usize| {
        let mut config = DbscanConfig::default();
        (config.eps, config.min_points) = (eps, min_points);
        Dbscan::new(config).unwrap_err().field
    };
    for eps in [0.0, -0.05, f32::NAN, f32::INFINITY, 1e-7, 2e6] {
        assert_eq!(refused(eps, 10), "dbscan.eps");
    }
    for min_points in [0, usize::MAX] {
        assert_eq!(refused(0.05, min_points), "dbscan.min_points");
    }
    dbscan(1e-6, 1);
    dbscan(1e6, 1_000_000_000);
}
