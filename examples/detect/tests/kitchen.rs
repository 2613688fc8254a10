//! Compares detections in the recorded kitchen with those stored with it, which the same network made
//! elsewhere.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use dymlm_detect::{Comparison, ImageSource, Yolox, YoloxConfig};
use dymlm_io::{DetectionFile, read_class_names};
use dymlm_test_support::recording;

/// Every tenth frame of both kitchens; `detect --compare` prints the same for all frames.
#[test]
fn detections_are_those_that_came_with_the_recordings() {
    let Some(network) = recording("models/yolox_nano.onnx") else { return };
    let yolox = Yolox::open(network, YoloxConfig::default()).unwrap();
    for name in ["kitchen", "kitchen_people"] {
        let Some(folder) = recording(name) else { return };
        let reference =
            DetectionFile::open(folder.join("detections.jsonl"), DetectionFile::DEFAULT_TOLERANCE).unwrap();
        let mut images = ImageSource::open(&folder, 10).unwrap();
        let mut comparison = Comparison::default();
        for index in 0..images.len() {
            let image = images.load(index).unwrap().unwrap();
            let timestamp = images.timestamp(index).unwrap();
            comparison.add(&yolox.detect(&image).unwrap(), &reference.at(timestamp).unwrap().unwrap());
        }
        println!("{name}: {comparison}");
        assert_eq!(comparison.frames(), 20);
        assert!(comparison.mean_iou() > 0.98, "{comparison}");
        // JPEG decoders differ by some grey levels, which moves scores by up to 0.05: of some 50 boxes one or two
        // are on the other side of a threshold.
        for [ours, theirs] in [comparison.sure_counts(), comparison.counts()] {
            assert!(ours.abs_diff(theirs) <= 2, "{comparison}");
        }
        assert!(comparison.matched() + 2 >= comparison.counts()[1], "{comparison}");
    }
}

#[test]
fn the_names_are_those_of_the_network() {
    let Some(names) = recording("models/coco_names.txt") else { return };
    assert_eq!(read_class_names(names).unwrap(), dymlm_detect::COCO_NAMES);
}
