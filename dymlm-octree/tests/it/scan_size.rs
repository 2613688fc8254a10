//! Scans of more cells than memory holds are refused before anything is allocated for them.
use crate::common::config;
use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose, SensorModel};
use dymlm_octree::{Error, Octree, RayMode};

/// A wall at this distance, metres.
fn wall(distance: f32) -> Frame {
    let camera = PinholeCamera::new(320, 240, 262.0, 262.0, 159.5, 119.5).unwrap();
    Frame::new(0.0, camera, DepthImage::new(320, 240, vec![distance; 320 * 240]).unwrap(), None).unwrap()
}

/// Points at this distance in the directions of a laser with 64 rings.
fn rings(distance: f32) -> Vec<[f32; 3]> {
    let ring = |i: usize| (i as f32 / 64.0 - 0.7) * 0.45;
    let ray = |i: usize| {
        let (angle, slope) = ((i / 64) as f32 * std::f32::consts::TAU / 1024.0, ring(i % 64));
        [distance * angle.cos(), distance * angle.sin(), distance * slope]
    };
    (0..64 * 1024).map(ray).collect()
}

#[test]
fn cells_too_small_for_the_range_are_refused_and_change_nothing() {
    let far = SensorModel { max_depth: f32::INFINITY, ..SensorModel::kinect() };
    // Cell, range, distance of the wall: all metres.
    for (resolution, range, distance) in
        [(0.001, 5.0, 4.9), (0.05, f64::INFINITY, 1500.0), (0.01, 100.0, 95.0)]
    {
        for rays in [RayMode::PerCell, RayMode::PerPoint] {
            let mut config = config(resolution, range);
            (config.rays, config.color) = (rays, true);
            let mut map = Octree::new(config).unwrap();
            map.insert_scan([0.0; 3], &[[0.01, 0.0, 0.0]]).unwrap();
            let (before, bytes) = (map.counts(), map.memory_bytes());
            let pose = Pose::identity();
            let frame = wall(distance);
            let refusals = [
                map.check_depth(&frame, &far, &pose),
                map.insert_depth(&frame, &far, None, &pose).map(|_| ()),
                map.check_scan([0.0; 3], &rings(distance)),
                map.insert_scan_colored([0.0; 3], &rings(distance), &vec![[9; 3]; 64 * 1024]).map(|_| ()),
            ];
            for refusal in refusals {
                assert!(matches!(refusal, Err(Error::ScanSize { .. })), "{resolution} {range} {refusal:?}");
            }
            assert_eq!(map.counts(), before);
            // Only the lists of cells may have grown.
            assert!(map.memory_bytes() < bytes + (32 << 20), "{}", map.memory_bytes());
            // Nothing of the refused scan is left in the next one.
            let report = map.insert_scan([0.0; 3], &[[0.01, 0.0, 0.0]]).unwrap();
            assert_eq!((report.hit_cells, map.counts()), (1, before));
        }
    }
}

#[test]
fn what_cameras_and_lasers_see_is_taken() {
    let taken = |resolution: f64, range: f64| Octree::new(config(resolution, range)).unwrap();
    let kinect = SensorModel::kinect();
    taken(0.05, 5.0).check_depth(&wall(4.9), &kinect, &Pose::identity()).unwrap();
    taken(0.01, 5.0).check_depth(&wall(4.9), &kinect, &Pose::identity()).unwrap();
    taken(0.005, 5.0).check_depth(&wall(2.9), &kinect, &Pose::identity()).unwrap();
    // A laser on a car: the ground 1.8 m below, and houses.
    let sees = |point: [f32; 3]| point.map(|c| c * (1.8 / (-point[2]).max(1.8)));
    let sight: Vec<_> = rings(60.0).into_iter().map(sees).collect();
    taken(0.1, 100.0).check_scan([0.0; 3], &sight).unwrap();
    let mut map = taken(0.02, 10.0);
    map.check_scan([0.0; 3], &rings(9.0)).unwrap();
    map.insert_scan([0.0; 3], &rings(9.0)).unwrap();
}
