//! Real recordings, read when they are beside the repository (or where `DYMLM_DATA` says); the synthetic
//! counterparts are `tum.rs`, `detections.rs` and `pcd.rs`.
use std::collections::BTreeSet;

use dymlm_io::{DetectionFile, FrameBuffers, TumDataset, TumOptions, read_pcd};
use dymlm_test_support::recording;

#[test]
fn the_kitchen_with_people_has_200_frames() {
    let Some(folder) = recording("kitchen_people") else { return };
    let tum = TumDataset::open(&folder, &TumOptions::default()).unwrap();
    assert_eq!(tum.frames().len(), 200);
    assert!(tum.faults().is_empty() && tum.gaps().is_empty());
    assert_eq!((tum.camera().width(), tum.camera().fx(), tum.depth_scale()), (640, 526.1, 5000.0));
    let detections =
        DetectionFile::open(folder.join("detections.jsonl"), DetectionFile::DEFAULT_TOLERANCE).unwrap();
    assert!(detections.faults().is_empty());

    let mut buffers = FrameBuffers::default();
    let mut people = 0;
    for (i, listed) in tum.frames().iter().enumerate() {
        let found = detections.at(listed.color_timestamp.unwrap()).unwrap().expect("a line a frame");
        people += found.iter().filter(|detection| detection.label() == "person").count();
        // Only every tenth frame is loaded: decoding all takes seconds.
        if i % 10 == 0 {
            let posed = tum.load_into(i, &mut buffers).unwrap();
            let readings = posed.frame.depth().data().iter().filter(|&&z| z > 0.0).count();
            assert!(readings > 100_000, "frame {i}: {readings} readings");
            buffers.recycle(posed.frame);
        }
    }
    assert_eq!(people, 197, "as the data's own README counts");
}

#[test]
fn the_cabinet_is_posed_although_its_frames_are_far_apart() {
    let Some(folder) = recording("cabinet") else { return };
    let tum = TumDataset::open(&folder, &TumOptions::default()).unwrap();
    assert_eq!(tum.frames().len(), 57);
    // At 1.5 Hz nothing may be interpolated, but every frame's time has a pose.
    assert_eq!(tum.gaps().len(), 56);
    assert!((0..57).step_by(8).all(|i| tum.load(i).is_ok()));
}

#[test]
fn clouds_of_the_segmentation_database_have_labels() {
    for n in [0, 10, 20, 30, 40] {
        let Some(path) = recording(&format!("clouds/mosd/learn{n}.pcd")) else { return };
        let cloud = read_pcd(path).unwrap();
        assert_eq!((cloud.width, cloud.height), (640, 480));
        let labels: Vec<u32> =
            cloud.field("label").unwrap().values.iter().map(|&label| label as u32).collect();
        let known: BTreeSet<u32> = labels.iter().map(|label| label / 10).collect();
        assert!(known.contains(&0) && known.contains(&2), "learn{n}: {known:?}");
        // Label 0 marks pixels without a point.
        let points = cloud.cloud.points();
        assert!(
            points.iter().zip(&labels).all(|(point, &label)| (label == 0) == point[2].is_nan()),
            "learn{n}"
        );
        assert_eq!(cloud.finite().len(), labels.iter().filter(|&&label| label > 0).count());
        assert!(cloud.cloud.colors().is_some());
    }
}

#[test]
fn clouds_of_the_tutorials_are_read() {
    for (name, points) in [
        ("table_scene_mug_stereo_textured", 307_200),
        ("person", 307_200),
        ("capture0001", 307_200),
        ("room_scan1", 112_586),
        ("room_scan2", 112_624),
        ("milk", 12_575),
        ("min_cut_segmentation_tutorial", 9_311),
        ("region_growing_tutorial", 108_104),
    ] {
        let Some(path) = recording(&format!("clouds/tutorials/{name}.pcd")) else { return };
        let cloud = read_pcd(path).unwrap();
        assert_eq!(cloud.cloud.len(), points, "{name}");
        assert!(cloud.finite().len() > points / 10, "{name}");
    }
}
