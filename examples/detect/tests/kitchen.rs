//! Detections in the recorded kitchen beside those that came with it, which the same network made elsewhere.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use dymlm_detect::{Comparison, ImageSource, Yolox, YoloxConfig};
use dymlm_io::{DetectionFile, read_class_names};
use dymlm_test_support::recording;

/// Every tenth frame of both kitchens; `detect --compare` says the same of all.
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
            comparison.add(&yolox.detect(&image).unwrap(), reference.at(timestamp).unwrap().unwrap());
        }
        println!("{name}: {comparison}");
        assert_eq!(comparison.frames(), 20);
        assert!(comparison.mean_iou() > 0.98, "{comparison}");
        let [sure, others] = comparison.sure_counts();
        assert!(sure.abs_diff(others) * 100 <= others, "{comparison}");
        let [all, others] = comparison.counts();
        assert!(
            all.abs_diff(others) * 100 <= others && comparison.matched() * 100 >= others * 99,
            "{comparison}"
        );
    }
}

#[test]
fn the_names_are_those_of_the_network() {
    let Some(names) = recording("models/coco_names.txt") else { return };
    assert_eq!(read_class_names(names).unwrap(), dymlm_detect::COCO_NAMES);
}
