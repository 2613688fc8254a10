//! Queries against brute force over the cells.

use crate::common::{Key, Random, config, double, leaves_of};
use dymlm_core::PointCloud;
use dymlm_octree::{CellState, Error, Octree, OctreeConfig, RayEnd, UnknownCells};
use proptest::prelude::*;

/// A map of some scans, clamped in parts, at 0.25 m (whose multiples are exact).
fn sample(seed: u64, scans: usize) -> Octree {
    let mut map = Octree::new(config(0.25, 5.0)).unwrap();
    let mut random = Random(seed);
    for _ in 0..scans {
        let origin = random.point(0.2);
        let points: Vec<_> = (0..60).map(|_| random.point(1.5)).collect();
        for _ in 0..3 {
            map.insert_scan(double(origin), &points).unwrap();
        }
    }
    map
}

/// Every cell of a map: its key and log-odds.
fn cells_of(map: &Octree) -> Vec<(Key, f32)> {
    let mut cells = Vec::new();
    for leaf in map.leaves() {
        let side = 1_u16 << (16 - leaf.depth);
        for x in 0..side {
            for y in 0..side {
                for z in 0..side {
                    cells.push(([leaf.key[0] + x, leaf.key[1] + y, leaf.key[2] + z], leaf.log_odds));
                }
            }
        }
    }
    cells
}

fn center(key: Key) -> [f64; 3] {
    key.map(|index| (f64::from(index) - 32768.0 + 0.5) * 0.25)
}

#[test]
fn leaves_tile_what_is_known() {
    let map = sample(1, 8);
    let mut cells = cells_of(&map);
    for (key, log_odds) in &cells {
        assert_eq!(map.log_odds(center(*key)), Some(*log_odds));
    }
    cells.sort_by_key(|cell| cell.0);
    assert!(cells.windows(2).all(|pair| pair[0].0 != pair[1].0), "leaves overlap");
    // Nothing else is known, within and around.
    let known: std::collections::BTreeSet<Key> = cells.iter().map(|cell| cell.0).collect();
    for x in 32744..32792 {
        for y in 32744..32792 {
            for z in 32744..32792 {
                assert_eq!(map.log_odds(center([x, y, z])).is_some(), known.contains(&[x, y, z]));
            }
        }
    }
    for leaf in map.leaves() {
        assert_eq!(leaf.size, 0.25 * f64::from(1 << (16 - leaf.depth)));
        assert_eq!(leaf.state, map.state(leaf.center));
        assert!((leaf.probability() - map.probability(center(leaf.key)).unwrap()).abs() < 1e-12);
    }
}

#[test]
fn coarser_cells_are_occupied_when_any_cell_in_them_is() {
    let map = sample(2, 6);
    let cells = cells_of(&map);
    let mut random = Random(3);
    for depth in 0..=16 {
        for _ in 0..60 {
            let point = double(random.point(2.5));
            let key = point.map(|coordinate| ((coordinate / 0.25).floor() + 32768.0) as u32);
            let max = cells
                .iter()
                .filter(|(cell, _)| {
                    (0..3).all(|axis| u32::from(cell[axis]) >> (16 - depth) == key[axis] >> (16 - depth))
                })
                .map(|cell| cell.1)
                .reduce(f32::max);
            let expected = match max {
                None => CellState::Unknown,
                Some(value) if value >= 0.0 => CellState::Occupied,
                Some(_) => CellState::Free,
            };
            assert_eq!(map.state_at_depth(point, depth), expected, "{point:?} at depth {depth}");
        }
    }
    assert_eq!(map.state_at_depth([f64::NAN; 3], 4), CellState::Unknown);
    assert_eq!(map.state_at_depth([0.1; 3], 200), map.state([0.1; 3]));
}

#[test]
fn boxes_hold_the_leaves_that_touch_them() {
    let map = sample(4, 6);
    let mut random = Random(5);
    for _ in 0..50 {
        let (a, b) = (double(random.point(2.0)), double(random.point(2.0)));
        let min: [f64; 3] = std::array::from_fn(|i| a[i].min(b[i]));
        let max: [f64; 3] = std::array::from_fn(|i| a[i].max(b[i]));
        let cell = |coordinate: f64| (coordinate / 0.25).floor() as i64 + 32768;
        let expected: Vec<_> = map
            .leaves()
            .filter(|leaf| {
                (0..3).all(|i| {
                    let first = i64::from(leaf.key[i]);
                    let last = first + (1 << (16 - leaf.depth)) - 1;
                    first <= cell(max[i]) && last >= cell(min[i])
                })
            })
            .collect();
        assert!(map.leaves_in_box(min, max).eq(expected));
    }
    assert_eq!(map.leaves_in_box([-1e9; 3], [1e9; 3]).count(), map.counts().leaves);
    for (min, max) in [([1.0; 3], [0.0; 3]), ([f64::NAN; 3], [1.0; 3]), ([1e5; 3], [1e6; 3])] {
        assert_eq!(map.leaves_in_box(min, max).count(), 0);
    }
    let everywhere = f64::INFINITY;
    assert_eq!(map.leaves_in_box([-everywhere; 3], [everywhere; 3]).count(), map.counts().leaves);
}

/// With this resolution, the index of a place just inside the upper border rounds to one beyond it.
#[test]
fn a_box_just_inside_the_border_holds_nothing_of_the_middle() {
    let mut map = Octree::new(config(0.055, 5.0)).unwrap();
    map.insert_scan([0.0; 3], &[[0.0, 0.0, 0.5]]).unwrap();
    let border = 0.055 * 32768.0_f64;
    for (min, max) in [(border.next_down(), border + 1e3), (-border - 1e3, -border), (-border, -border)] {
        assert_eq!(map.leaves_in_box([min; 3], [max; 3]).count(), 0, "{min} to {max}");
    }
    let all = map.leaves_in_box([-border; 3], [border.next_down(); 3]).count();
    assert!(all > 0 && all == map.counts().leaves);
}

#[test]
fn the_extent_is_that_of_all_cells() {
    let map = sample(6, 4);
    let cells = cells_of(&map);
    let extent = map.extent().unwrap();
    for axis in 0..3 {
        let indices = cells.iter().map(|cell| f64::from(cell.0[axis]) - 32768.0);
        assert_eq!(extent.min[axis], indices.clone().fold(f64::INFINITY, f64::min) * 0.25);
        assert_eq!(extent.max[axis], (indices.fold(f64::NEG_INFINITY, f64::max) + 1.0) * 0.25);
    }
}

#[test]
fn the_nearest_obstacle_is_the_nearest_of_all() {
    let map = sample(7, 5);
    let occupied: Vec<Key> =
        cells_of(&map).into_iter().filter(|cell| cell.1 >= 0.0).map(|cell| cell.0).collect();
    assert!(occupied.len() > 20);
    let mut random = Random(8);
    for _ in 0..200 {
        let point = double(random.point(4.0));
        let distance = |key: &Key| {
            let center = center(*key);
            (0..3).map(|i| ((point[i] - center[i]).abs() - 0.125).max(0.0).powi(2)).sum::<f64>().sqrt()
        };
        let expected = occupied.iter().map(distance).fold(f64::INFINITY, f64::min);
        let nearest = map.nearest_obstacle(point, f64::INFINITY).unwrap();
        assert!((nearest.distance - expected).abs() < 1e-9, "{} is not {expected}", nearest.distance);
        assert_eq!(map.state(nearest.center), CellState::Occupied);
        let offset: f64 = (0..3).map(|i| (nearest.point[i] - point[i]).powi(2)).sum();
        assert!((offset.sqrt() - nearest.distance).abs() < 1e-9);
        assert_eq!(map.nearest_obstacle(point, expected - 1e-6).is_some(), expected == 0.0);
        assert!(map.nearest_obstacle(point, expected + 1e-6).is_some());
    }
    assert_eq!(map.nearest_obstacle([f64::NAN; 3], 1.0), None);
    assert_eq!(map.nearest_obstacle([1e200, 0.0, 0.0], f64::INFINITY), None);
    assert_eq!(
        map.nearest_obstacle([0.0; 3], f64::NAN).is_some(),
        map.state([0.0; 3]) == CellState::Occupied
    );
    let empty = Octree::new(OctreeConfig::default()).unwrap();
    assert_eq!(empty.nearest_obstacle([0.0; 3], f64::INFINITY), None);
}

#[test]
fn of_equally_near_obstacles_the_lowest_is_the_answer() {
    let mut map = Octree::new(config(1.0, 50.0)).unwrap();
    for point in [[3.5, 0.5, 0.5], [-2.5, 0.5, 0.5], [0.5, 3.5, 0.5], [0.5, -2.5, 0.5], [0.5, 0.5, 3.5]] {
        map.set_log_odds(point, Some(2.0));
    }
    let nearest = map.nearest_obstacle([0.5; 3], 10.0).unwrap();
    assert_eq!(nearest.center, [-2.5, 0.5, 0.5]);
    // Eight equal cells become one large leaf, here at higher x: the small one is still the lowest.
    for cell in (0..8).map(|i| [2 + i % 2, i / 2 % 2, i / 4]) {
        map.set_log_odds(cell.map(|c| f64::from(c) + 0.5), Some(2.0));
    }
    map.set_log_odds([-0.5, 0.5, 0.5], Some(2.0));
    let nearest = map.nearest_obstacle([1.0, 0.5, 0.5], 10.0).unwrap();
    assert_eq!((nearest.center, nearest.size), ([-0.5, 0.5, 0.5], 1.0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    /// Rays against small steps along them: no sample before the end may lie in a cell that would have
    /// stopped the ray.
    #[test]
    fn rays_stop_at_the_first_cell_that_stops_them(seed in 0..50_u64, origin in [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0], direction in [-1.0..1.0_f64, -1.0..1.0, -1.0..1.0], pass: bool, max_range in 0.5..8.0_f64) {
        let length = direction.iter().map(|value| value * value).sum::<f64>().sqrt();
        prop_assume!(length > 0.1);
        let map = sample(seed, 3);
        let unknown = if pass { UnknownCells::Pass } else { UnknownCells::Stop };
        let hit = map.cast_ray(origin, direction, max_range, unknown).unwrap();
        let at = |t: f64| std::array::from_fn(|i| origin[i] + direction[i] / length * t);
        // Samples very near a border may fall on either side of it.
        let border = |point: [f64; 3]| point.iter().any(|c| ((c / 0.25) - (c / 0.25).round()).abs() < 1e-4);
        let mut t = 0.0;
        while t < hit.distance - 1e-4 {
            let state = map.state(at(t));
            prop_assert!(border(at(t)) || (state != CellState::Occupied && (pass || state != CellState::Unknown)));
            t += 0.01;
        }
        match hit.end {
            RayEnd::Occupied => prop_assert_eq!(map.state(hit.center), CellState::Occupied),
            RayEnd::Unknown => prop_assert!(!pass && map.state(hit.center) == CellState::Unknown),
            RayEnd::MaxRange => {
                let offset: f64 = (0..3).map(|i| (hit.center[i] - origin[i]).powi(2)).sum();
                prop_assert!(offset.sqrt() > max_range - 1e-4);
            }
            RayEnd::Border => prop_assert!(false),
        }
        let inside = (0..3).all(|i| (at(hit.distance)[i] - hit.center[i]).abs() < 0.125 + 1e-4);
        prop_assert!(inside, "the ray enters elsewhere");
        prop_assert_eq!(map.accessor().cast_ray(origin, direction, max_range, unknown), Some(hit));
    }

    #[test]
    fn an_accessor_answers_as_the_map(seed in 0..50_u64, points in proptest::collection::vec([-4.0..4.0_f64, -4.0..4.0, -4.0..4.0], 100)) {
        let map = sample(seed, 4);
        let mut accessor = map.accessor();
        for point in points {
            prop_assert_eq!(accessor.log_odds(point), map.log_odds(point));
            prop_assert_eq!(accessor.state(point), map.state(point));
        }
        prop_assert_eq!(accessor.state([f64::NAN; 3]), CellState::Unknown);
    }

    /// Setting and forgetting cells one by one: pruned leaves open and close.
    #[test]
    fn cells_can_be_set_and_forgotten(changes in proptest::collection::vec(([0..6_u16, 0..6, 0..6], prop_oneof![Just(None), Just(Some(1.0_f32)), Just(Some(-1.0))]), 1..600)) {
        let mut map = Octree::new(config(0.25, 5.0)).unwrap();
        let mut naive = crate::common::Naive::new(0.25, 5.0, true);
        for ([x, y, z], value) in changes {
            let key = [32766 + x, 32766 + y, 32766 + z];
            map.set_log_odds(center(key), value);
            match value {
                Some(value) => naive.cells.insert(key, value),
                None => naive.cells.remove(&key),
            };
        }
        prop_assert_eq!(leaves_of(&map), naive.leaves());
        prop_assert_eq!(map.is_empty(), naive.cells.is_empty());
    }
}

#[test]
fn rays_without_a_start_or_a_direction_are_none() {
    let map = sample(9, 1);
    let cast = |origin, direction| map.cast_ray(origin, direction, 5.0, UnknownCells::Pass);
    assert_eq!(cast([1e9; 3], [1.0, 0.0, 0.0]), None);
    assert_eq!(cast([f64::NAN; 3], [1.0, 0.0, 0.0]), None);
    assert_eq!(cast([0.0; 3], [0.0; 3]), None);
    assert_eq!(cast([0.0; 3], [f64::INFINITY, 0.0, 0.0]), None);
    assert_eq!(cast([0.0; 3], [0.0, f64::NAN, 0.0]), None);
    // Tiny and huge vectors have a direction too.
    for length in [1e-300, 1e-20, 1e20, 1e300] {
        assert_eq!(cast([0.1; 3], [length, 0.0, 0.0]), cast([0.1; 3], [1.0, 0.0, 0.0]));
    }
}

#[test]
fn a_ray_through_nothing_ends_at_the_border() {
    let map = Octree::new(config(1.0, 5.0)).unwrap();
    let hit = map.cast_ray([0.5; 3], [1.0, 0.0, 0.0], f64::INFINITY, UnknownCells::Pass).unwrap();
    assert_eq!((hit.end, hit.center), (RayEnd::Border, [32767.5, 0.5, 0.5]));
    let hit = map.cast_ray([0.5; 3], [1.0, 0.0, 0.0], f64::INFINITY, UnknownCells::Stop).unwrap();
    assert_eq!((hit.end, hit.distance), (RayEnd::Unknown, 0.0));
    let hit = map.cast_ray([0.5; 3], [0.0, -1.0, 0.0], f64::NAN, UnknownCells::Pass).unwrap();
    assert_eq!(hit.end, RayEnd::MaxRange);
}

#[test]
fn merged_maps_add_their_evidence() {
    for (a, b) in [(1, 2), (3, 4)] {
        let (first, second) = (sample(a, 6), sample(b, 6));
        let mut merged = first.clone();
        merged.merge(&second).unwrap();
        let mut keys: std::collections::BTreeSet<Key> =
            cells_of(&first).into_iter().map(|cell| cell.0).collect();
        keys.extend(cells_of(&second).into_iter().map(|cell| cell.0));
        let mut expected = crate::common::Naive::new(0.25, 5.0, true);
        for key in keys {
            let log_odds = |map: &Octree| map.log_odds(center(key)).unwrap_or(0.0);
            expected.cells.insert(
                key,
                (log_odds(&first) + log_odds(&second)).clamp(crate::common::MIN, crate::common::MAX),
            );
        }
        assert_eq!(leaves_of(&merged), expected.leaves());
        // The other order gives the same.
        let mut other_way = second.clone();
        other_way.merge(&first).unwrap();
        assert_eq!(leaves_of(&other_way), leaves_of(&merged));
        // Merging an empty map changes nothing.
        let before = leaves_of(&merged);
        merged.merge(&Octree::new(config(0.25, 1.0)).unwrap()).unwrap();
        assert_eq!(leaves_of(&merged), before);
        let error = merged.merge(&Octree::new(config(0.5, 1.0)).unwrap()).unwrap_err();
        assert!(matches!(error, Error::Resolution { .. }));
        assert_eq!(leaves_of(&merged), before);
    }
}

#[test]
fn merged_maps_blend_their_colours() {
    let colored = |points: &[[f32; 3]], color| {
        let mut config = config(0.25, 5.0);
        config.color = true;
        let mut map = Octree::new(config).unwrap();
        map.insert_scan_colored([0.1; 3], points, &vec![color; points.len()]).unwrap();
        map
    };
    let mut map = colored(&[[1.1, 0.1, 0.1], [0.1, 1.1, 0.1]], [10, 20, 30]);
    map.merge(&colored(&[[1.1, 0.1, 0.1], [0.1, 0.1, 1.1]], [20, 40, 60])).unwrap();
    assert_eq!(map.color([1.1, 0.1, 0.1]), Some([15, 30, 45]));
    assert_eq!(map.color([0.1, 1.1, 0.1]), Some([10, 20, 30]));
    assert_eq!(map.color([0.1, 0.1, 1.1]), Some([20, 40, 60]));
}

#[test]
fn maximum_likelihood_keeps_states_and_joins_leaves() {
    let map = sample(12, 8);
    let mut rounded = map.clone();
    rounded.to_max_likelihood();
    assert!(rounded.counts().leaves < map.counts().leaves);
    for (key, _) in cells_of(&map) {
        assert_eq!(rounded.state(center(key)), map.state(center(key)));
        let log_odds = rounded.log_odds(center(key)).unwrap();
        assert!(log_odds == crate::common::MIN || log_odds == crate::common::MAX);
    }
}

#[test]
fn values_are_clamped_when_set() {
    let mut map = Octree::new(OctreeConfig::default()).unwrap();
    map.set_log_odds([0.0; 3], Some(100.0));
    assert_eq!(map.log_odds([0.0; 3]), Some(crate::common::MAX));
    map.set_log_odds([0.0; 3], Some(f32::NEG_INFINITY));
    assert_eq!(map.log_odds([0.0; 3]), Some(crate::common::MIN));
    map.set_log_odds([0.0; 3], Some(f32::NAN));
    assert!(map.is_empty());
    map.set_log_odds([1e9; 3], Some(1.0));
    assert!(map.is_empty());
}

/// One map has a leaf of 8^3 cells where the other has a single cell.
#[test]
fn merged_colors_do_not_depend_on_the_size_of_leaves() {
    let colored = |points: &[[f32; 3]], color| {
        let mut config = config(0.25, 4.0);
        config.color = true;
        let cloud = PointCloud::with_colors(points.to_vec(), vec![color; points.len()]).unwrap();
        Octree::from_cloud(&cloud, config).unwrap()
    };
    let at = |i: usize| [i % 8, i / 8 % 8, i / 64].map(|index| index as f32 * 0.25 + 0.125);
    let block: Vec<[f32; 3]> = (0..512).map(at).collect();
    let (large, small) = (colored(&block, [100; 3]), colored(&block[..1], [50; 3]));
    assert_eq!((large.counts().leaves, small.counts().leaves), (1, 1));
    for (first, second) in [(&large, &small), (&small, &large)] {
        let mut merged = first.clone();
        merged.merge(second).unwrap();
        assert_eq!(merged.color(double(at(0))), Some([75; 3]));
        assert_eq!(merged.color(double(at(1))), Some([100; 3]));
        assert_eq!(merged.color(double(at(511))), Some([100; 3]));
    }
}

#[test]
fn what_is_far_is_unknown_again_and_what_is_near_stays() {
    let mut config = config(0.25, 20.0);
    config.color = true;
    let mut map = Octree::new(config.clone()).unwrap();
    let mut random = Random(5);
    for _ in 0..40 {
        // Rays that are long enough for leaves larger than a block.
        let points: Vec<_> = (0..400).map(|_| random.point(16.0)).collect();
        map.insert_scan([0.1; 3], &points).unwrap();
    }
    let cells = cells_of(&map);
    let (center, radius, block) = ([3.0, -2.0, 0.5], 4.0, 8.0 * 0.25 * 3_f64.sqrt());
    let distance = |key: Key| {
        let place = key.map(|index| (f64::from(index) - 32768.0 + 0.5) * 0.25);
        dymlm_core::vector3::norm(dymlm_core::vector3::difference(place, center))
    };
    map.forget_outside(center, 1e4);
    assert_eq!(cells_of(&map), cells, "nothing is that far");

    map.forget_outside(center, radius);
    let sorted = |cells: Vec<(Key, f32)>| {
        let mut near: Vec<_> = cells.into_iter().filter(|&(key, _)| distance(key) <= radius).collect();
        near.sort_unstable_by_key(|(key, _)| *key);
        near
    };
    let left = cells_of(&map);
    assert!(left.len() < cells.len() / 2 && left.iter().all(|&(key, _)| distance(key) <= radius + block));
    assert_eq!(sorted(left), sorted(cells));

    // The tree is as one that was never larger: its nodes are pruned, its bounds are those of what is left.
    let mut same = Octree::new(config).unwrap();
    for (key, log_odds) in cells_of(&map) {
        let place = key.map(|index| (f64::from(index) - 32768.0 + 0.5) * 0.25);
        same.set_log_odds(place, Some(log_odds));
    }
    assert_eq!(map.counts(), same.counts());
    let bytes = map.memory_bytes();
    map.forget_outside([1e9; 3], 1.0);
    assert!(map.is_empty());
    for (key, log_odds) in cells_of(&same) {
        map.set_log_odds(key.map(|index| (f64::from(index) - 32768.0 + 0.5) * 0.25), Some(log_odds));
    }
    assert_eq!(map.counts(), same.counts());
    // Not just as many: the tables of freed nodes may have had spare room.
    assert!(map.memory_bytes() <= bytes, "freed nodes are used again");
}
