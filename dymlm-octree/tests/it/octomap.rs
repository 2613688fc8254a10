//! Agreement with OctoMap: the files in `data/` were written by OctoMap 1.9.7 itself, by `data/generate.cpp`.

use crate::common::{Random, config, double};
use dymlm_octree::{Octree, OctreeConfig, RayEnd, RayMode, UnknownCells};
use dymlm_test_support::{checksum, recording};

/// The three scans of `insertScattered`.
fn insert_scattered(map: &mut Octree) {
    let mut random = Random(7);
    for scan in 0..3 {
        let origin = random.point(0.5);
        let mut points: Vec<_> = (0..12).map(|_| random.point(2.0)).collect();
        points.push(points[0]);
        points.push([points[1][0] + 0.0625, points[1][1], points[1][2]]);
        if map.config().color {
            // In the generator, too, only the first twelve have colours.
            points.truncate(12);
            let colors: Vec<_> = (0..12_u8).map(|i| [20 * i, 100 + scan, 250 - 20 * i]).collect();
            map.insert_scan_colored(double(origin), &points, &colors).unwrap();
        } else {
            map.insert_scan(double(origin), &points).unwrap();
        }
    }
}

fn written(map: &Octree) -> Vec<u8> {
    let mut file = Vec::new();
    map.write_ot(&mut file).unwrap();
    file
}

#[test]
fn the_same_discretized_scans_give_the_same_file() {
    let mut map = Octree::new(config(0.2, 2.5)).unwrap();
    insert_scattered(&mut map);
    assert_eq!(written(&map), include_bytes!("../data/scattered.ot"));
}

#[test]
fn the_same_scans_ray_by_ray_give_the_same_file() {
    let mut config = config(0.2, 2.5);
    config.rays = RayMode::PerPoint;
    let mut map = Octree::new(config).unwrap();
    insert_scattered(&mut map);
    assert_eq!(written(&map), include_bytes!("../data/per_point.ot"));
    assert_ne!(&include_bytes!("../data/per_point.ot")[..], include_bytes!("../data/scattered.ot"));
}

/// The walls of `walls()`.
fn room() -> Octree {
    let mut points = Vec::new();
    for axis in 0..3 {
        for side in [-1.0_f32, 1.0] {
            for i in -8..8 {
                for j in -8..8 {
                    let mut point = [0.0; 3];
                    point[axis] = 1.53125 * side;
                    point[(axis + 1) % 3] = (i as f32 + 0.5) * 0.1875;
                    point[(axis + 2) % 3] = (j as f32 + 0.5) * 0.1875;
                    points.push(point);
                }
            }
        }
    }
    let mut map = Octree::new(config(0.25, f64::INFINITY)).unwrap();
    for i in 0..8 {
        map.insert_scan([0.03125 * f64::from(i), 0.0625, 0.125], &points).unwrap();
    }
    map
}

#[test]
fn clamped_and_pruned_space_gives_the_same_files() {
    let map = room();
    assert!(map.leaves().any(|leaf| leaf.depth < 16), "the scene does not prune");
    assert_eq!(written(&map), include_bytes!("../data/room.ot"));
    let mut binary = Vec::new();
    map.write_bt(&mut binary).unwrap();
    assert_eq!(binary, include_bytes!("../data/room.bt"));
}

#[test]
fn rays_end_in_the_same_cells() {
    let map = room();
    let mut random = Random(7);
    let mut hits = 0;
    for (i, line) in include_str!("../data/rays.txt").lines().enumerate() {
        let expected: Vec<u16> = line.split(' ').map(|word| word.parse().unwrap()).collect();
        let (origin, direction) = (random.point(0.5), random.point(1.0));
        let unknown = if i % 2 == 1 { UnknownCells::Pass } else { UnknownCells::Stop };
        let max_range = if i % 4 < 2 { 2.0 } else { 1.4 };
        let hit = map.cast_ray(double(origin), double(direction), max_range, unknown).unwrap();
        let key = hit.center.map(|coordinate| ((coordinate / 0.25).floor() + 32768.0) as u16);
        assert_eq!(
            (u16::from(hit.end == RayEnd::Occupied), key.as_slice()),
            (expected[0], &expected[1..]),
            "ray {i}"
        );
        hits += expected[0];
    }
    assert!((16..48).contains(&hits), "{hits} of 64 rays hit: the test says little");
}

#[test]
fn colours_are_averaged_as_octomap_does() {
    let mut config = config(0.2, f64::INFINITY);
    config.color = true;
    let mut map = Octree::new(config).unwrap();
    insert_scattered(&mut map);
    let theirs = Octree::read_ot(&include_bytes!("../data/colored.ot")[..], OctreeConfig::default()).unwrap();
    assert!(theirs.config().color);
    let colored: Vec<_> = theirs.leaves().filter(|leaf| leaf.color.is_some()).collect();
    assert!(colored.len() > 30, "{} coloured leaves", colored.len());
    for leaf in colored {
        assert_eq!(map.color(leaf.center), leaf.color, "{leaf:?}");
    }
}

/// Log-odds of OctoMap's own files are read bit by bit: written again, they are the same file.
#[test]
fn files_are_read_and_written_back_byte_by_byte() {
    for file in [
        &include_bytes!("../data/scattered.ot")[..],
        include_bytes!("../data/per_point.ot"),
        include_bytes!("../data/room.ot"),
    ] {
        assert_eq!(written(&Octree::read_ot(file, OctreeConfig::default()).unwrap()), file);
    }
    let file = &include_bytes!("../data/room.bt")[..];
    let mut again = Vec::new();
    Octree::read_bt(file, OctreeConfig::default()).unwrap().write_bt(&mut again).unwrap();
    assert_eq!(again, file);
}

/// A corridor recorded by the University of Freiburg. OctoMap counts 532566 nodes and 428144 leaves in it.
#[test]
fn the_corridor_is_read_and_written_back() {
    let Some(path) = recording("octomap/geb079.bt") else { return };
    let map = Octree::load_bt(&path, OctreeConfig::default()).unwrap();
    let counts = map.counts();
    assert_eq!((counts.nodes, counts.leaves, map.resolution()), (532_566, 428_144, 0.08));
    let mut again = Vec::new();
    map.write_bt(&mut again).unwrap();
    let file = std::fs::read(path).unwrap();
    assert_eq!(tree_data(&again), tree_data(&file));
}

/// What follows the header (whose comments differ between versions).
fn tree_data(file: &[u8]) -> &[u8] {
    let end = file.windows(6).position(|window| window == b"\ndata\n").unwrap();
    &file[end + 6..]
}

/// `ScanGraph::readBinary` and `insertPointCloud(node, max_range, false, discretize)` at 0.1 m, then `write`:
/// the number of nodes, leaves, occupied leaves, and the FNV-1a hash of the file, by OctoMap 1.9.7.
#[test]
fn the_spherical_scan_gives_the_same_files() {
    let Some(path) = recording("octomap/spherical_scan.graph") else { return };
    let bytes = std::fs::read(path).unwrap();
    let number = |at: usize| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) as usize;
    let coordinate = |at: usize| f64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as f32;
    let origin = [1.0_f32, 0.0, -0.5];
    let points: Vec<[f32; 3]> = (0..number(4))
        .map(|i| std::array::from_fn(|axis| coordinate(8 + 28 * i + 4 + 8 * axis) + origin[axis]))
        .collect();
    for (max_range, rays, nodes, leaves, occupied, hash) in SPHERICAL {
        let mut config = config(0.1, max_range);
        config.rays = rays;
        let mut map = Octree::new(config).unwrap();
        map.insert_scan(double(origin), &points).unwrap();
        let counts = map.counts();
        assert_eq!((counts.nodes, counts.leaves, counts.occupied_leaves), (nodes, leaves, occupied));
        assert_eq!(checksum(written(&map)), hash, "{max_range} {rays:?}");
    }
}

const SPHERICAL: [(f64, RayMode, usize, usize, usize, u64); 4] = [
    (f64::INFINITY, RayMode::PerPoint, 6296, 4926, 1521, 0x98eb_49ed_8fe1_b944),
    (f64::INFINITY, RayMode::PerCell, 6387, 5002, 1521, 0x568b_5f29_5b93_4311),
    (3.0, RayMode::PerPoint, 2720, 2036, 0, 0x81e9_72dd_2177_965d),
    (3.0, RayMode::PerCell, 2725, 2033, 0, 0x5a14_bb11_c526_bfeb),
];
