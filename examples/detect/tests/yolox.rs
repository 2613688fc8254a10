//! Tests with networks made by hand: their detections, and which files are refused.
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use std::fs;

use common::{BLUE, ColorNetwork, RED, image_of};
use dymlm_detect::{Yolox, YoloxConfig};

fn config() -> YoloxConfig {
    let mut config = YoloxConfig::default();
    config.class_names = ["red thing", "blue thing"].map(String::from).to_vec();
    config
}

fn open(network: &ColorNetwork) -> Result<Yolox, String> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("network.onnx");
    network.write(&path);
    Yolox::open(&path, config()).map_err(|error| error.to_string())
}

#[test]
fn squares_are_found_where_they_are_and_named() {
    for any_batch in [false, true] {
        let network = ColorNetwork { any_batch, ..ColorNetwork::new([64, 64], 8) };
        let yolox = open(&network).unwrap();
        assert_eq!(yolox.input_size(), [64, 64]);
        // The network sees the image at half its size: squares of 8 pixels, on cells of its finest grid.
        let image = image_of([128, 96], &[(RED, [32, 16], 16), (BLUE, [112, 80], 16)]);
        let found = yolox.detect(&image).unwrap();
        let mut found: Vec<_> =
            found.iter().map(|one| (one.label(), <[f32; 4]>::from(one.bounding_box()))).collect();
        found.sort_by(|a, b| b.0.cmp(a.0));
        assert_eq!(
            found,
            [("red thing", [32.0, 16.0, 48.0, 32.0]), ("blue thing", [112.0, 80.0, 128.0, 96.0])]
        );
        assert!(yolox.detect(&image_of([128, 96], &[])).unwrap().is_empty());
    }
}

#[test]
fn inputs_may_be_wider_than_high_and_images_of_any_size() {
    let yolox = open(&ColorNetwork::new([128, 64], 32)).unwrap();
    for side in [1_usize, 3] {
        // A square of a cell in the second column and row, however large the image.
        let image = image_of([128 * side, 64 * side], &[(RED, [32 * side, 32 * side], 32 * side)]);
        let found = yolox.detect(&image).unwrap();
        let expected = [32.0, 32.0, 64.0, 64.0].map(|place| place * side as f32);
        assert_eq!(found.len(), 1, "{found:?}");
        for (side, known) in <[f32; 4]>::from(found[0].bounding_box()).into_iter().zip(expected) {
            assert!((side - known).abs() < 1e-3, "{found:?}");
        }
        assert!(found[0].score() > 0.99);
    }
    // At the most elongated proportion, 32 to 1, one row of pixels is left.
    assert!(yolox.detect(&image_of([4096, 32], &[])).unwrap().is_empty());
    let error = yolox.detect(&image_of([4096, 31], &[])).unwrap_err().to_string();
    assert!(error.contains("4096x31"), "{error}");
}

#[test]
fn scores_below_the_least_one_are_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("network.onnx");
    ColorNetwork::new([64, 64], 8).write(&path);
    let image = image_of([64, 64], &[([200, 60, 60], [8, 8], 8)]);
    let count = |min_score: f32| {
        let mut config = config();
        config.min_score = min_score;
        Yolox::open(&path, config).unwrap().detect(&image).unwrap().len()
    };
    let score = {
        let mut config = config();
        config.min_score = 0.0;
        Yolox::open(&path, config).unwrap().detect(&image).unwrap()[0].score()
    };
    assert!((0.5..0.99).contains(&score), "{score}");
    assert_eq!((count(score), count(score + 1e-3)), (1, 0));

    for bad in [-0.1, 1.1, f32::NAN] {
        let mut config = config();
        config.min_score = bad;
        let error = Yolox::open(&path, config).unwrap_err().to_string();
        assert!(error.contains("detector.min_score"), "{error}");
    }
}

#[test]
fn other_networks_are_refused_with_what_differs() {
    let error = open(&ColorNetwork::new([72, 64], 8)).unwrap_err();
    assert!(error.contains("not a YOLOX network") && error.contains("72x64"), "{error}");
    let transposed = ColorNetwork { rows_are_cells: false, ..ColorNetwork::new([64, 64], 8) };
    let error = open(&transposed).unwrap_err();
    assert!(error.contains("7 rows of 84") && error.contains("84 rows"), "{error}");

    // That its scores are no probabilities shows in the first image.
    let raw = ColorNetwork { has_sigmoid: false, ..ColorNetwork::new([64, 64], 8) };
    let image = image_of([64, 64], &[(RED, [0, 0], 8)]);
    let error = open(&raw).unwrap().detect(&image).unwrap_err().to_string();
    assert!(error.contains("row 0 of the network's output is no detection"), "{error}");
}

#[test]
fn names_must_be_those_of_the_network() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("network.onnx");
    ColorNetwork::new([64, 64], 8).write(&path);
    let error = Yolox::open(&path, YoloxConfig::default()).unwrap_err().to_string();
    assert!(error.contains("network.onnx: 80 class names for a network of 2 classes"), "{error}");
}

#[test]
fn files_that_are_no_network_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("network.onnx");
    let error = |path| Yolox::open(path, config()).unwrap_err().to_string();
    assert!(error(&path).contains("network.onnx"), "is not there");
    let network = {
        ColorNetwork::new([64, 64], 8).write(&path);
        fs::read(&path).unwrap()
    };
    for bytes in
        [&b""[..], b"no network at all", &network[..network.len() / 2], &network[..network.len() - 3]]
    {
        fs::write(&path, bytes).unwrap();
        assert!(error(&path).contains("network.onnx"), "{}", error(&path));
    }
}
