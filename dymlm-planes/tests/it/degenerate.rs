//! Frames without much in them.

use dymlm_core::{DepthImage, Frame, FrameId, Mask, PinholeCamera, Pose, SensorModel};
use dymlm_planes::{Error, PlaneConfig, PlaneMapper};

fn planes_of(width: usize, height: usize, data: Vec<f32>) -> usize {
    let camera = PinholeCamera::new(width, height, width as f64, width as f64, 0.0, 0.0).unwrap();
    let frame = Frame::new(0.0, camera, DepthImage::new(width, height, data).unwrap(), None).unwrap();
    let mut detector = crate::common::detector();
    let found = detector.detect(&frame, None, &[]).unwrap().len();
    found + detector.rejected().len()
}

#[test]
fn no_reading_no_plane() {
    assert_eq!(planes_of(160, 120, vec![0.0; 160 * 120]), 0);
    assert_eq!(planes_of(160, 120, vec![50.0; 160 * 120]), 0);
    assert_eq!(planes_of(160, 120, vec![f32::NAN; 160 * 120]), 0);
    assert_eq!(planes_of(160, 120, vec![f32::MIN_POSITIVE; 160 * 120]), 0);
}

#[test]
fn a_constant_depth_is_one_plane_at_any_size() {
    for (width, height) in [(80, 60), (161, 97), (320, 240), (640, 480), (1283, 719)] {
        assert_eq!(planes_of(width, height, vec![2.0; width * height]), 1, "{width}x{height}");
    }
}

#[test]
fn single_rows_and_pixels_are_no_planes() {
    for (width, height) in [(1, 1), (3, 2), (640, 1), (1, 480)] {
        assert_eq!(planes_of(width, height, vec![2.0; width * height]), 0, "{width}x{height}");
    }
    let mut stripes = vec![0.0; 320 * 240];
    for v in (0..240).step_by(4) {
        stripes[v * 320..(v + 1) * 320].fill(1.5);
    }
    assert_eq!(planes_of(320, 240, stripes), 0);
}

/// A strip of a single row of blocks has no pairs of blocks one above the other, from which a frame's
/// unevenness is measured; that of the frame before is not its own.
#[test]
fn a_strip_does_not_depend_on_the_frame_before() {
    let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    let frame = |depth: &dyn Fn(usize, usize) -> f32| {
        let depths = (0..640 * 480).map(|i| depth(i % 640, i / 640)).collect();
        Frame::new(0.0, camera, DepthImage::new(640, 480, depths).unwrap(), None).unwrap()
    };
    // Blocks of 8 x 8 pixels that stand 6 mm before or behind their neighbours.
    let uneven = frame(&|u, v| 1.5 + if (u / 8 + v / 8) % 2 == 0 { 0.003 } else { -0.003 });
    // A strip that bends by 1.5 mm to and fro.
    let strip =
        frame(&|u, v| if (96..104).contains(&v) { 1.5 + 0.0015 * (u as f32 / 40.0).sin() } else { 0.0 });

    let mut used = crate::common::detector();
    used.detect(&uneven, None, &[]).unwrap();
    used.detect(&strip, None, &[]).unwrap();
    let mut fresh = crate::common::detector();
    fresh.detect(&strip, None, &[]).unwrap();
    assert_eq!(used.planes(), fresh.planes());
    assert_eq!(used.rejected(), fresh.rejected());
    assert!(used.labels() == fresh.labels(), "other pixels");
}

#[test]
fn noise_is_no_plane() {
    let noise =
        (0..320 * 240_u32).map(|i| 1.0 + (i.wrapping_mul(2_654_435_761) >> 8) as f32 * 1e-7).collect();
    assert_eq!(planes_of(320, 240, noise), 0);
}

#[test]
fn masked_pixels_take_no_part() {
    let frame = crate::common::room().frame(crate::common::camera(), &crate::common::room_views()[0], 1);
    let mut mask = Mask::filled(320, 240, true).unwrap();
    for v in 0..240 {
        mask.fill_row(v, 0..160, false);
    }
    let mut detector = crate::common::detector();
    assert!(!detector.detect(&frame, Some(&mask), &[]).unwrap().is_empty());
    assert!(detector.labels().iter().zip(mask.pixels()).all(|(&label, chosen)| chosen || label == 0));
    for plane in detector.planes() {
        let labelled = detector.labels().iter().filter(|&&label| label == plane.label).count();
        assert_eq!(labelled, plane.support);
    }
}

#[test]
fn refused_input_changes_nothing() {
    let frame = crate::common::room().frame(crate::common::camera(), &crate::common::room_views()[0], 1);
    let mut mapper = crate::common::mapper();
    mapper.insert(&frame, None, &[], &crate::common::room_views()[0]).unwrap();
    let planes = crate::common::snapshot(mapper.map());
    let labels = mapper.detector().labels().to_vec();

    let small = Mask::filled(10, 10, true).unwrap();
    let refused = mapper.insert(&frame, Some(&small), &[], &Pose::identity());
    assert!(matches!(refused, Err(Error::Core(_))));
    assert_eq!(mapper.detector().labels(), labels);
    let far = Pose::new([1e7, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    assert!(matches!(mapper.insert(&frame, None, &[], &far), Err(Error::OutOfReach { .. })));
    let unknown = FrameId::new(7);
    assert_eq!(mapper.map_mut().remove(unknown), Err(Error::UnknownKeyFrame { key_frame: unknown }));
    assert_eq!(crate::common::snapshot(mapper.map()), planes);

    let mut config = PlaneConfig::default();
    config.detector.block_size = 1;
    let error = PlaneMapper::new(config, SensorModel::kinect()).unwrap_err();
    assert_eq!(error.to_string(), "planes.detector.block_size = 1 is outside its range 4..=64");
}
