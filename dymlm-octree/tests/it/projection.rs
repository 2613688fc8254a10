//! The projection to a 2D grid, and its files.

use crate::common::{Random, config, double};
use dymlm_octree::{CellState, Error, Octree, OctreeConfig};
use dymlm_test_support::growth;

fn sample() -> Octree {
    let mut map = Octree::new(config(0.25, 5.0)).unwrap();
    let mut random = Random(41);
    for _ in 0..6 {
        let points: Vec<_> = (0..50).map(|_| random.point(1.5)).collect();
        map.insert_scan(double(random.point(0.3)), &points).unwrap();
    }
    map
}

/// For up = z: each grid cell against its column of octree cells.
#[test]
fn columns_are_summed_up() {
    let map = sample();
    let grid = map.project([0.0, 0.0, 3.0], -0.5, 1.25).unwrap();
    let mut seen = [0; 3];
    for y in 0..grid.height() {
        for x in 0..grid.width() {
            let [world_x, world_y] = grid.center(x, y);
            let column: Vec<_> =
                (-2..5).map(|k| map.state([world_x, world_y, (f64::from(k) + 0.5) * 0.25])).collect();
            let expected = if column.contains(&CellState::Occupied) {
                CellState::Occupied
            } else if column.contains(&CellState::Free) {
                CellState::Free
            } else {
                CellState::Unknown
            };
            assert_eq!(grid.at(x, y), expected, "({x}, {y})");
            seen[expected as usize] += 1;
        }
    }
    assert!(seen.iter().all(|&count| count > 10), "{seen:?}");
    // The grid ends where the observations between the heights do.
    let [min_x, min_y] = grid.origin();
    let max = [min_x + grid.width() as f64 * 0.25, min_y + grid.height() as f64 * 0.25];
    for leaf in map.leaves().filter(|leaf| leaf.center[2] > -0.5 && leaf.center[2] < 1.25) {
        assert!(leaf.center[0] > min_x && leaf.center[0] < max[0]);
        assert!(leaf.center[1] > min_y && leaf.center[1] < max[1]);
    }
    assert_eq!(grid.at(grid.width(), 0), CellState::Unknown);
}

/// A camera's world: y points down. The same scene, turned, gives the same picture.
#[test]
fn up_can_be_any_direction() {
    let floor: Vec<[f32; 3]> = (0..40)
        .flat_map(|i| (0..40).map(move |j| [0.13 + 0.1 * i as f32, 0.13 + 0.1 * j as f32, 0.05]))
        .collect();
    let wall: Vec<[f32; 3]> = (0..40)
        .flat_map(|i| (0..10).map(move |k| [2.05, 0.13 + 0.1 * i as f32, 0.5 + 0.1 * k as f32]))
        .collect();
    let points = [floor, wall].concat();
    let mut upright = Octree::new(config(0.1, 9.0)).unwrap();
    upright.insert_scan([0.55, 2.05, 1.05], &points).unwrap();
    let turn = |p: [f32; 3]| [p[0], -p[2], p[1]];
    let mut turned = Octree::new(config(0.1, 9.0)).unwrap();
    let points: Vec<_> = points.into_iter().map(turn).collect();
    turned.insert_scan(double(turn([0.55, 2.05, 1.05])), &points).unwrap();

    let a = upright.project([0.0, 0.0, 1.0], 0.3, 1.2).unwrap();
    let b = turned.project([0.0, -1.0, 0.0], 0.3, 1.2).unwrap();
    let occupied = |grid: &dymlm_octree::OccupancyGrid| {
        grid.cells().iter().filter(|&&c| c == CellState::Occupied).count()
    };
    assert!(occupied(&a) >= 38, "{}", occupied(&a));
    let share = occupied(&b) as f64 / occupied(&a) as f64;
    assert!((0.9..1.1).contains(&share), "{} and {} occupied cells", occupied(&a), occupied(&b));
    // An occupied grid cell is above an occupied place of the world.
    let world_from_grid = b.world_from_grid();
    for y in 0..b.height() {
        for x in 0..b.width() {
            if b.at(x, y) == CellState::Occupied {
                let [grid_x, grid_y] = b.center(x, y);
                let met = (0..90).any(|k| {
                    let point =
                        world_from_grid.transform_point([grid_x, grid_y, 0.305 + 0.01 * f64::from(k)]);
                    turned.state(point) == CellState::Occupied
                });
                assert!(met, "({x}, {y})");
            }
        }
    }
    // A slanted direction leaves no holes: the wall still is closed.
    let slanted = upright.project([0.05, 0.08, 1.0], 0.5, 1.2).unwrap();
    assert!(occupied(&slanted) >= 30);
}

#[test]
fn nothing_between_the_heights_is_an_empty_grid() {
    let map = sample();
    for grid in [
        map.project([0.0, 0.0, 1.0], 100.0, 200.0),
        Octree::new(OctreeConfig::default()).unwrap().project([0.0, 0.0, 1.0], 0.0, 1.0),
    ] {
        let grid = grid.unwrap();
        assert_eq!((grid.width(), grid.height(), grid.cells().len()), (0, 0, 0));
        grid.write_pgm(Vec::new()).unwrap();
    }
    let all = map.project([0.0, 0.0, 1.0], f64::NEG_INFINITY, f64::INFINITY).unwrap();
    assert!(all.width() > 10);
}

#[test]
fn refuses_what_is_no_projection() {
    let map = sample();
    for (up, min, max) in [
        ([0.0; 3], 0.0, 1.0),
        ([f64::NAN, 0.0, 1.0], 0.0, 1.0),
        ([0.0, f64::INFINITY, 1.0], 0.0, 1.0),
        ([0.0, 0.0, 1.0], 1.0, 1.0),
        ([0.0, 0.0, 1.0], 2.0, 1.0),
        ([0.0, 0.0, 1.0], f64::NAN, 1.0),
    ] {
        assert!(matches!(map.project(up, min, max), Err(Error::Projection { .. })), "{up:?} {min} {max}");
    }
    let mut wide = Octree::new(config(0.01, 5.0)).unwrap();
    wide.set_log_odds([-327.0, -327.0, 0.0], Some(1.0));
    wide.set_log_odds([327.0, 327.0, 0.0], Some(1.0));
    assert!(matches!(
        wide.project([0.0, 0.0, 1.0], -1.0, 1.0),
        Err(Error::GridSize { width: 65401, height: 65401 })
    ));
}

#[test]
fn files_are_what_map_server_reads() {
    let mut map = Octree::new(config(0.5, 5.0)).unwrap();
    map.set_log_odds([0.25, 0.25, 0.25], Some(1.0));
    map.set_log_odds([1.25, 0.25, 0.25], Some(-1.0));
    map.set_log_odds([-0.75, 0.75, 0.25], Some(-1.0));
    let grid = map.project([0.0, 0.0, 1.0], 0.0, 0.5).unwrap();
    let folder = tempfile::tempdir().unwrap();
    grid.save(folder.path(), "kitchen").unwrap();
    let image = std::fs::read(folder.path().join("kitchen.pgm")).unwrap();
    // Highest y first.
    assert_eq!(
        image,
        [b"P5\n5 2\n255\n".as_slice(), &[254, 205, 205, 205, 205], &[205, 205, 0, 205, 254]].concat()
    );
    let yaml = std::fs::read_to_string(folder.path().join("kitchen.yaml")).unwrap();
    assert_eq!(
        yaml,
        "image: \"kitchen.pgm\"\nmode: trinary\nresolution: 0.5\norigin: [-1, 0, 0.0]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n"
    );
    let error = grid.save(folder.path().join("nowhere"), "kitchen").unwrap_err();
    assert!(error.to_string().contains("kitchen.pgm"), "{error}");
}

/// A file of one free leaf at a depth, below the first child of all nodes above it.
fn file_of_one_leaf(depth: u8) -> Vec<u8> {
    const INNER: u8 = 0b11;
    const FREE: u8 = 0b01;
    let mut file =
        format!("# Octomap OcTree binary file\nid OcTree\nsize {}\nres 0.05\ndata\n", depth + 1).into_bytes();
    for level in 1..=depth {
        file.extend([if level == depth { FREE } else { INNER }, 0]);
    }
    file
}

#[test]
fn a_large_leaf_takes_as_long_as_its_face() {
    let read = |depth| Octree::read_bt(file_of_one_leaf(depth).as_slice(), OctreeConfig::default()).unwrap();
    let [small, large] = [read(10), read(8)];
    for up in [[0.0, 0.0, 1.0], [0.2, 0.1, 1.0]] {
        // The large leaf has 16 times as many columns, each with 4 times as many cells.
        let most = 32.0;
        let project = |map: &Octree| map.project(up, f64::NEG_INFINITY, f64::INFINITY).unwrap();
        let times = growth(most, &small, &large, project);
        assert!(times <= most, "{up:?}: {times} times as long");
    }
}

/// Columns are followed from leaf to leaf; from cell to cell they would give the same.
#[test]
fn large_leaves_are_seen_as_their_cells() {
    let mut map = sample();
    map.to_max_likelihood();
    // Free cubes of 8 and 16 cells a side, and an occupied one, beside the rest.
    for (corner, side, log_odds) in
        [([2.0, 2.0, -2.0], 8, -1.0), ([-8.0, -4.0, -4.0], 16, -1.0), ([4.0, -4.0, 2.0], 8, 1.0)]
    {
        for i in 0..side * side * side {
            let cell = [i % side, i / side % side, i / side / side];
            let point = [0, 1, 2].map(|axis| corner[axis] + (f64::from(cell[axis]) + 0.5) * 0.25);
            map.set_log_odds(point, Some(log_odds));
        }
    }
    assert!(map.leaves().any(|leaf| leaf.depth <= 12));
    let mut random = Random(7);
    let mut seen = [0; 3];
    for round in 0..20 {
        let up = if round == 0 { [0.0, 0.0, 1.0] } else { double(random.point(1.0)) };
        let grid = map.project(up, -2.7, 2.9).unwrap();
        let pose = grid.world_from_grid();
        for index in (0..grid.width() * grid.height()).step_by(7) {
            let [x, y] = grid.center(index % grid.width(), index / grid.width());
            // Many points of the line, and a margin where it may leave the heights or touch an edge.
            let states: Vec<CellState> = (0..5570)
                .map(|k| -2.69 + f64::from(k) * 0.001)
                .map(|height| map.state(pose.transform_point([x, y, height])))
                .collect();
            let most =
                [CellState::Occupied, CellState::Free].map(|s| states.iter().filter(|&&t| t == s).count());
            let at = grid.at(index % grid.width(), index / grid.width());
            seen[at as usize] += 1;
            // More samples than on an edge that the line grazes.
            if most[0] > 10 {
                assert_eq!(at, CellState::Occupied, "{up:?}");
            } else if most[0] == 0 && most[1] > 10 {
                assert_ne!(at, CellState::Unknown, "{up:?}");
            }
        }
    }
    assert!(seen.iter().all(|&count| count > 10), "{seen:?}");
}
