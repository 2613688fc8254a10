//! The same bits with and without the feature `parallel`: the gate runs these tests under both, and both must
//! give the checksums written here. Inputs are made of integers, so that no library of elementary functions
//! has a say.

#![allow(clippy::unwrap_used, reason = "tests")]

use dymlm_cloud::{CloudMap, CloudMapConfig, Selection};
use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose, SensorModel};
use dymlm_test_support::{checksum, whole_numbers};

const CLOUD_MAP: u64 = 13_742_596_637_450_255_052;

#[test]
fn the_static_cloud_has_the_same_bits() {
    let camera = PinholeCamera::new(160, 120, 128.0, 128.0, 79.5, 59.5).unwrap();
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect()).unwrap();
    let mut numbers = whole_numbers();
    for step in 0..6 {
        let depth =
            (0..160 * 120).map(|i| 2.0 + (i % 160) as f32 / 128.0 + numbers.next().unwrap() as f32 * 3e-5);
        let depth = DepthImage::new(160, 120, depth.collect()).unwrap();
        let frame = Frame::new(f64::from(step), camera, depth, None).unwrap();
        let pose = Pose::new([f64::from(step) / 64.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        map.insert(&frame, None, &pose).unwrap();
        // Each reading takes in what has changed.
        assert_eq!(map.is_empty(), step == 0);
    }
    let cloud = map.point_cloud(Selection::Static);
    assert!(cloud.len() > 1000);
    let bytes = cloud.points().iter().flatten().flat_map(|c| c.to_le_bytes());
    assert_eq!(checksum(bytes), CLOUD_MAP);
}
