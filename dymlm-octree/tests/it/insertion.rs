//! Insertion against a naive map of cells.

use crate::common::{Naive, Random, config, double, leaves_of};
use dymlm_core::{ColorImage, DepthImage, Frame, Mask, PinholeCamera, PointCloud, Pose, SensorModel};
use dymlm_octree::CellState::{self, Free, Occupied, Unknown};
use dymlm_octree::{Error, Octree, OctreeConfig, RayMode};
use proptest::prelude::*;

type Scan = ([f32; 3], Vec<[f32; 3]>);

fn any_point(half: f32) -> impl Strategy<Value = [f32; 3]> {
    // Coordinates on borders between cells are as likely as others.
    let coordinate = prop_oneof![-half..half, (-20..20_i8).prop_map(|i| f32::from(i) * 0.1)];
    [coordinate.clone(), coordinate.clone(), coordinate]
}

fn any_scans() -> impl Strategy<Value = Vec<Scan>> {
    proptest::collection::vec((any_point(1.0), proptest::collection::vec(any_point(3.0), 0..40)), 1..12)
}

fn both_maps(scans: &[Scan], resolution: f64, max_range: f64, rays: RayMode) -> (Octree, Naive) {
    let mut config = config(resolution, max_range);
    config.rays = rays;
    let mut map = Octree::new(config).unwrap();
    let mut naive = Naive::new(resolution, max_range, rays == RayMode::PerCell);
    for (origin, points) in scans {
        map.insert_scan(double(*origin), points).unwrap();
        naive.insert_scan(*origin, points);
    }
    (map, naive)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn leaves_are_those_of_the_naive_map(scans in any_scans(), resolution in 0.05..0.6_f64, max_range in 0.5..6.0_f64, per_cell: bool) {
        let rays = if per_cell { RayMode::PerCell } else { RayMode::PerPoint };
        let (map, naive) = both_maps(&scans, resolution, max_range, rays);
        prop_assert_eq!(leaves_of(&map), naive.leaves());
        prop_assert_eq!(map.counts().nodes, naive.nodes());
        prop_assert_eq!(map.counts().leaves, naive.leaves().len());
    }

    /// The same scans many times over: everything is clamped, pruned, and expanded again by the last scan.
    #[test]
    fn pruned_leaves_expand_again(scans in any_scans(), last in any_point(2.0)) {
        let mut repeated: Vec<_> = std::iter::repeat_n(scans, 9).flatten().collect();
        repeated.push(([0.05; 3], vec![last]));
        let (map, naive) = both_maps(&repeated, 0.4, f64::INFINITY, RayMode::PerCell);
        prop_assert_eq!(leaves_of(&map), naive.leaves());
    }

    /// The order of points, and points given twice, change nothing.
    #[test]
    fn a_scan_is_a_set(scan in any_scans(), seed: u64) {
        let (origin, points) = &scan[0];
        let mut shuffled = [points.as_slice(), points.as_slice()].concat();
        let mut random = Random(seed);
        for i in (1..shuffled.len()).rev() {
            let j = (random.next().abs() * 1024.0) as usize % (i + 1);
            shuffled.swap(i, j);
        }
        let mut maps = [points, &shuffled].map(|points| {
            let mut map = Octree::new(config(0.1, 4.0)).unwrap();
            map.insert_scan(double(*origin), points).unwrap();
            leaves_of(&map)
        });
        prop_assert_eq!(std::mem::take(&mut maps[0]), std::mem::take(&mut maps[1]));
    }
}

/// Cells so small, and points so far, that sparse marks replace the dense window.
#[test]
fn wide_scans_give_the_same_leaves() {
    for rays in [RayMode::PerCell, RayMode::PerPoint] {
        let mut random = Random(3);
        let scans: Vec<Scan> =
            (0..2).map(|_| (random.point(1.0), (0..20).map(|_| random.point(40.0)).collect())).collect();
        let (map, naive) = both_maps(&scans, 0.02, f64::INFINITY, rays);
        assert!(map.memory_bytes() > 1 << 20);
        assert_eq!(leaves_of(&map), naive.leaves());
        let (map, naive) = both_maps(&scans, 0.02, 60.0, rays);
        assert_eq!(leaves_of(&map), naive.leaves());
    }
}

/// Solid clamped free space: blocks and branches become single leaves, and are opened again.
#[test]
fn large_leaves_are_made_and_opened() {
    let mut random = Random(11);
    // Points all over a sphere: their rays fill the ball.
    let points: Vec<[f32; 3]> = (0..6000)
        .map(|_| {
            let p = random.point(1.0);
            let length = crate::common::norm(p) as f32;
            p.map(|value| value / length * 2.5)
        })
        .collect();
    let scans: Vec<Scan> = (0..12).map(|i| ([0.01 * i as f32, 0.0, 0.0], points.clone())).collect();
    let (mut map, mut naive) = both_maps(&scans, 0.1, f64::INFINITY, RayMode::PerCell);
    assert_eq!(leaves_of(&map), naive.leaves());
    let smallest = map.leaves().map(|leaf| leaf.depth).min().unwrap();
    assert!(smallest <= 13, "largest leaf at depth {smallest}");
    for end in [[0.05, 0.05, 0.05], [0.5, 0.5, 0.5], [-0.7, 0.3, 0.1]] {
        map.insert_scan([0.01, 0.02, 0.03], &[end]).unwrap();
        naive.insert_scan([0.01, 0.02, 0.03], &[end]);
        assert_eq!(leaves_of(&map), naive.leaves());
    }
}

#[test]
fn what_cannot_be_inserted_is_skipped_and_counted() {
    let mut map = Octree::new(config(0.01, 5.0)).unwrap();
    let points = [
        [1.0, 0.0, 0.0],
        [f32::NAN, 0.0, 0.0],
        [0.0, f32::INFINITY, 0.0],
        [0.0, 0.0, f32::NEG_INFINITY],
        [400.0, 0.0, 0.0],
        [0.0, f32::MAX, -f32::MAX],
        [1.0, 0.0, 0.0],
        [7.0, 0.0, 0.0],
    ];
    let report = map.insert_scan([0.0; 3], &points).unwrap();
    assert_eq!((report.readings, report.not_finite, report.outside), (8, 3, 2));
    assert_eq!((report.rays, report.cut_rays, report.hit_cells), (2, 1, 1));
    let states = [1.0, 2.0, 4.9, 5.5, 7.0].map(|x| map.state([x, 0.0, 0.0]));
    assert_eq!(states, [Occupied, Free, Free, Unknown, Unknown]);
}

#[test]
fn an_empty_scan_changes_nothing() {
    let mut map = Octree::new(OctreeConfig::default()).unwrap();
    assert_eq!(map.insert_scan([0.0; 3], &[]).unwrap().rays, 0);
    assert!(map.is_empty());
    assert_eq!(map.counts().nodes, 0);
    assert_eq!(map.extent(), None);
}

#[test]
fn a_refused_scan_changes_nothing() {
    let mut map = Octree::new(OctreeConfig::default()).unwrap();
    map.insert_scan([0.0; 3], &[[1.0, 0.0, 0.0]]).unwrap();
    let before = leaves_of(&map);
    for origin in [[f64::NAN, 0.0, 0.0], [0.0, 1e9, 0.0], [0.0, 0.0, f64::INFINITY]] {
        assert!(matches!(map.insert_scan(origin, &[[0.0; 3]]), Err(Error::Origin { .. })));
    }
    assert!(matches!(map.insert_scan_colored([0.0; 3], &[[0.0; 3]], &[]), Err(Error::Core(_))));
    let (frame, pose) = test_frame();
    let mask = Mask::filled(2, 1, true).unwrap();
    assert!(map.insert_depth(&frame, &SENSOR, Some(&mask), &pose).is_err());
    let far = Pose::new([1e7, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let report = map.insert_depth(&frame, &SENSOR, None, &far).unwrap();
    assert!(report.readings > 0 && report.outside == report.readings && report.rays == 0);
    assert_eq!(leaves_of(&map), before);
}

/// From outside the map as from inside, and however near a reading may be.
#[test]
fn pixels_without_depth_are_no_readings() {
    let (frame, pose) = test_frame();
    let far = Pose::new([1e7, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let mut depths = frame.depth().data().to_vec();
    depths[1..4].copy_from_slice(&[f32::INFINITY, -1.0, 1e-3]);
    let depth = DepthImage::new(32, 24, depths).unwrap();
    let frame = Frame::new(0.0, *frame.camera(), depth, None).unwrap();
    let mask = Mask::new(32, 24, (0..32 * 24).map(|i| i % 32 < 20).collect()).unwrap();
    for (min_depth, mask) in [(0.0, None), (0.0, Some(&mask)), (0.3, None), (2.1, Some(&mask))] {
        let mut sensor = SENSOR;
        sensor.min_depth = min_depth;
        let [inside, outside] = [&pose, &far].map(|pose| {
            Octree::new(OctreeConfig::default()).unwrap().insert_depth(&frame, &sensor, mask, pose).unwrap()
        });
        let is_reading = |&i: &usize| {
            let z = frame.depth().data()[i];
            z.is_finite() && z > 0.0 && z >= min_depth && mask.is_none_or(|mask| mask.at(i % 32, i / 32))
        };
        let expected = (0..32 * 24).filter(is_reading).count();
        assert_eq!([inside.readings, outside.readings, outside.outside], [expected; 3], "{min_depth} m");
    }
}

#[test]
fn scans_at_the_border_of_the_map_are_harmless() {
    let mut map = Octree::new(config(0.1, f64::INFINITY)).unwrap();
    let edge = 3276.79_f32;
    map.insert_scan(double([edge; 3]), &[[edge, edge, edge - 2.0], [edge - 3.0, edge, edge], [-edge; 3]])
        .unwrap();
    map.insert_scan(double([-edge; 3]), &[[-edge, 1.0 - edge, -edge]]).unwrap();
    assert_eq!(map.state(double([edge, edge, edge - 2.0])), CellState::Occupied);
    assert_eq!(map.state(double([-edge, 0.5 - edge, -edge])), CellState::Free);
    let mut cut = Octree::new(config(0.1, 3.0)).unwrap();
    let report = cut.insert_scan(double([edge; 3]), &[[0.0; 3]]).unwrap();
    assert_eq!((report.cut_rays, report.hit_cells), (1, 0));
}

const SENSOR: SensorModel = SensorModel::kinect();

fn test_frame() -> (Frame, Pose) {
    let camera = PinholeCamera::new(32, 24, 26.0, 26.0, 15.5, 11.5).unwrap();
    let mut random = Random(5);
    let data = (0..32 * 24)
        .map(|i| match i % 11 {
            0 => 0.0,
            5 => f32::NAN,
            _ => 2.0 + 0.01 * (i % 32) as f32 + 0.2 * random.next(),
        })
        .collect();
    let pose = Pose::new([0.3, -0.2, 1.1], [0.5, -0.5, 0.5, 0.5]).unwrap();
    let depth = DepthImage::new(32, 24, data).unwrap();
    let image = ColorImage::new(32, 24, (0..32 * 24).map(|i| [(i % 251) as u8, 7, 9]).collect()).unwrap();
    (Frame::new(0.0, camera, depth, Some(image)).unwrap(), pose)
}

/// A depth frame means one ray for each pixel with a reading: checked against the naive map, pixel by pixel.
#[test]
fn a_depth_frame_is_the_scan_of_its_static_pixels() {
    let (frame, pose) = test_frame();
    let mask = Mask::new(32, 24, (0..32 * 24).map(|i| i % 32 < 20).collect()).unwrap();
    for mask in [None, Some(&mask)] {
        for max_range in [f64::INFINITY, 2.2] {
            let mut map = Octree::new(config(0.1, max_range)).unwrap();
            let report = map.insert_depth(&frame, &SENSOR, mask, &pose).unwrap();
            let mut points = Vec::new();
            for v in 0..24 {
                for u in 0..32 {
                    let z = frame.depth().at(u, v);
                    if z > 0.0 && mask.is_none_or(|mask| mask.at(u, v)) {
                        let point = frame.camera().back_project([u as f64, v as f64], z.into());
                        points.push(pose.transform_point(point).map(|value| value as f32));
                    }
                }
            }
            assert_eq!(report.readings, points.len());
            let mut naive = Naive::new(0.1, max_range, true);
            naive.insert_scan(pose.translation().map(|value| value as f32), &points);
            assert_eq!(leaves_of(&map), naive.leaves());
        }
    }
}

#[test]
fn masked_pixels_say_nothing_of_the_space_before_them() {
    let (frame, pose) = test_frame();
    let mut map = Octree::new(config(0.1, 5.0)).unwrap();
    let nothing = Mask::filled(32, 24, false).unwrap();
    let report = map.insert_depth(&frame, &SENSOR, Some(&nothing), &pose).unwrap();
    assert_eq!(report.readings, 0);
    assert!(map.is_empty());
}

/// No scan leaves marks behind: a map that has seen other scans before is the same as a fresh one.
#[test]
fn buffers_are_clean_between_scans() {
    let mut random = Random(17);
    let scans: Vec<Scan> = (0..6)
        .map(|i| (random.point(0.5), (0..50).map(|_| random.point(1.0 + i as f32 * 7.0)).collect()))
        .collect();
    let mut used = Octree::new(config(0.05, f64::INFINITY)).unwrap();
    for (origin, points) in scans.iter().chain(&scans) {
        used.insert_scan(double(*origin), points).unwrap();
        let mut fresh = Octree::new(config(0.05, f64::INFINITY)).unwrap();
        fresh.insert_scan(double(*origin), points).unwrap();
        let mut cleared = used.clone();
        cleared.clear();
        used.clear();
        assert!(used.is_empty());
        used.insert_scan(double(*origin), points).unwrap();
        cleared.insert_scan(double(*origin), points).unwrap();
        assert_eq!(leaves_of(&used), leaves_of(&fresh));
        assert_eq!(leaves_of(&cleared), leaves_of(&fresh));
    }
}

/// A clone of a map has no buffers: they are what the two differ in.
#[test]
fn the_buffers_of_colours_are_counted() {
    let mut random = Random(9);
    let points: Vec<[f32; 3]> = (0..2000).map(|_| random.point(2.0)).collect();
    let mut config = config(0.05, f64::INFINITY);
    config.color = true;
    let buffers = |colors: Option<&[[u8; 3]]>| {
        let mut map = Octree::new(config.clone()).unwrap();
        let report = match colors {
            Some(colors) => map.insert_scan_colored([0.0; 3], &points, colors),
            None => map.insert_scan([0.0; 3], &points),
        };
        (map.memory_bytes() - map.clone().memory_bytes(), report.unwrap().hit_cells)
    };
    let [(plain, cells), (colored, same_cells)] = [buffers(None), buffers(Some(&vec![[1, 2, 3]; 2000]))];
    assert_eq!(cells, same_cells);
    // A sum of three channels and a count, and the key, for each cell.
    assert!(colored >= plain + cells * (4 * 8 + 6), "{cells} cells: {colored} bytes after {plain}");
}

#[test]
fn memory_stands_still_when_nothing_new_is_seen() {
    let (frame, pose) = test_frame();
    let mut map = Octree::new(config(0.02, 5.0)).unwrap();
    map.insert_depth(&frame, &SENSOR, None, &pose).unwrap();
    let first = map.memory_bytes();
    for _ in 0..30 {
        map.insert_depth(&frame, &SENSOR, None, &pose).unwrap();
    }
    assert_eq!(map.memory_bytes(), first);
}

fn colored(resolution: f64) -> OctreeConfig {
    let mut config = config(resolution, 5.0);
    config.color = true;
    config
}

#[test]
fn a_cell_has_the_mean_colour_of_its_points_and_blends_it_with_the_next_scans() {
    let mut map = Octree::new(colored(0.1)).unwrap();
    let cell = [1.05, 0.05, 0.05];
    let points = [[1.01, 0.05, 0.05], [1.09, 0.05, 0.05], [0.05, 2.05, 0.05], [1.02, 0.02, 0.05]];
    let colors = [[10, 0, 100], [20, 0, 100], [255, 255, 255], [30, 0, 103]];
    map.insert_scan_colored([0.05; 3], &points, &colors).unwrap();
    assert_eq!(map.color(cell), Some([20, 0, 101]));
    map.insert_scan_colored([0.05; 3], &points[..1], &[[40, 8, 0]]).unwrap();
    assert_eq!(map.color(cell), Some([30, 4, 50]));
    // White is "no colour" in the files, and is stored slightly darker.
    assert_eq!(map.color([0.05, 2.05, 0.05]), Some([255, 255, 254]));
    // Free and unknown cells have no colour.
    assert_eq!(map.color([0.55, 0.05, 0.05]), None);
    assert_eq!(map.color([9.0; 3]), None);
    assert_eq!(map.color([f64::NAN; 3]), None);
}

#[test]
fn depth_frames_carry_their_colours() {
    let (frame, pose) = test_frame();
    let mask = Mask::new(32, 24, (0..32 * 24).map(|i| i % 3 != 0).collect()).unwrap();
    let mut map = Octree::new(colored(0.02)).unwrap();
    let report = map.insert_depth(&frame, &SENSOR, Some(&mask), &pose).unwrap();
    let colors = map.leaves().filter(|leaf| leaf.color.is_some()).count();
    assert_eq!(colors, report.hit_cells);
    // Pixel (4, 3) alone in its cell has its own colour.
    let (u, v) = (4, 3);
    assert!(mask.at(u, v) && frame.depth().at(u, v) > 0.0);
    let point = pose
        .transform_point(frame.camera().back_project([u as f64, v as f64], frame.depth().at(u, v).into()));
    assert_eq!(map.color(point), Some([(v * 32 + u) as u8, 7, 9]));
    // Without the colour mode, colours are ignored.
    let mut plain = Octree::new(config(0.02, 5.0)).unwrap();
    plain.insert_depth(&frame, &SENSOR, Some(&mask), &pose).unwrap();
    assert_eq!(leaves_of(&plain), leaves_of(&map));
    assert!(plain.leaves().all(|leaf| leaf.color.is_none()));
}

#[test]
fn plain_conversion_hits_each_cell_once() {
    let mut random = Random(23);
    let mut points: Vec<[f32; 3]> = (0..500).map(|_| random.point(1.0)).collect();
    points.extend([[f32::NAN; 3], [1e30; 3]]);
    let colors = vec![[9, 8, 7]; points.len()];
    let cloud = PointCloud::with_colors(points.clone(), colors).unwrap();
    let map = Octree::from_cloud(&cloud, colored(0.1)).unwrap();
    let naive = Naive::new(0.1, 1.0, true);
    let cells: std::collections::BTreeSet<_> = points.iter().filter_map(|&point| naive.key(point)).collect();
    assert_eq!(map.counts().occupied_leaves, map.counts().leaves);
    let volume: usize = map.leaves().map(|leaf| 1 << (3 * (16 - leaf.depth))).sum();
    assert_eq!(volume, cells.len());
    assert!(map.leaves().all(|leaf| leaf.log_odds == crate::common::HIT && leaf.color == Some([9, 8, 7])));
    let empty = Octree::from_cloud(&PointCloud::default(), OctreeConfig::default()).unwrap();
    assert!(empty.is_empty());
}

/// Regression: equal cells had become one leaf before they had their colours, so that its colour was that of
/// the cells that came last.
#[test]
fn a_large_leaf_of_a_converted_cloud_has_the_mean_color() {
    let cells = || (0..512).map(|cell| [cell % 8, cell / 8 % 8, cell / 64]);
    let points = cells().map(|cell| cell.map(|c| (c as f32 + 0.5) * 0.1)).collect();
    let colors = cells().map(|[_, _, z]| if z < 4 { [200, 0, 0] } else { [0, 0, 200] }).collect();
    let cloud = PointCloud::with_colors(points, colors).unwrap();
    let map = Octree::from_cloud(&cloud, colored(0.1)).unwrap();
    assert_eq!(map.counts().leaves, 1);
    assert_eq!(map.color([0.05; 3]), Some([100, 0, 100]));
}

/// The square of the offset underflows in single precision: a ray without a length, from one cell into the
/// next.
#[test]
fn rays_without_a_length_end_in_their_first_cell() {
    for end in [[-1e-30, 0.0, 0.0], [-1e-30, -1e-30, 0.0], [-1e-30; 3]] {
        let mut config = OctreeConfig::default();
        config.rays = RayMode::PerPoint;
        let mut map = Octree::new(config).unwrap();
        let report = map.insert_scan([0.0; 3], &[end]).unwrap();
        assert_eq!((report.rays, report.hit_cells, report.missed_cells), (1, 1, 1));
        assert_eq!(map.state([0.0; 3]), Free);
        assert_eq!(map.state(double(end)), Occupied);
    }
}

/// The index of such a reading's cell is -1, whose bits are all ones.
#[test]
fn readings_one_cell_outside_are_counted() {
    let mut map = Octree::new(OctreeConfig::default()).unwrap();
    let x = (-32768.5 * map.resolution()) as f32;
    let report = map.insert_scan([0.0; 3], &[[x, 0.0, 0.0], [0.0, x, 0.0], [1.0, 0.0, 0.0]]).unwrap();
    assert_eq!((report.readings, report.outside, report.hit_cells), (3, 2, 1));
}

#[test]
fn converted_points_are_occupied_whatever_the_bounds() {
    for p_clamp_max in [0.971, 0.5, 0.6] {
        let mut config = OctreeConfig::default();
        config.p_clamp_max = p_clamp_max;
        let map = Octree::from_cloud(&PointCloud::new(vec![[1.0; 3]]), config).unwrap();
        assert_eq!(map.state([1.0; 3]), Occupied, "{p_clamp_max}");
        assert!(map.probability([1.0; 3]).unwrap() < p_clamp_max + 1e-6);
    }
}

/// Readings of 0.2 m, of 2 m and of 4 m in three parts of an image, for a sensor with a range of 0.3 to 3 m.
#[test]
fn readings_beyond_the_sensors_range_free_cells_up_to_its_end_and_nearer_ones_say_nothing() {
    let camera = PinholeCamera::new(30, 8, 26.0, 26.0, 14.5, 3.5).unwrap();
    let depth = (0..240).map(|i| [0.2, 2.0, 4.0][i % 30 / 10]).collect();
    let frame = Frame::new(0.0, camera, DepthImage::new(30, 8, depth).unwrap(), None).unwrap();
    let sensor = SensorModel { max_depth: 3.0, ..SENSOR };
    for rays in [RayMode::PerCell, RayMode::PerPoint] {
        let mut config = config(0.05, f64::INFINITY);
        config.rays = rays;
        let mut map = Octree::new(config).unwrap();
        let report = map.insert_depth(&frame, &sensor, None, &Pose::identity()).unwrap();
        assert_eq!(report.readings, 160);
        let state_at = |u: f64, z: f64| map.state(frame.camera().back_project([u, 3.0], z));
        assert_eq!(
            [state_at(15.0, 1.9), state_at(15.0, 2.0), state_at(15.0, 2.2)],
            [Free, Occupied, Unknown]
        );
        assert_eq!([state_at(25.0, 2.8), state_at(25.0, 3.1), state_at(25.0, 4.0)], [Free, Unknown, Unknown]);
        assert_eq!(state_at(5.0, 0.2), Unknown);
        assert!(map.leaves().all(|leaf| leaf.center[2] < 3.1));
    }
}
