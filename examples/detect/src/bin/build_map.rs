//! `build_map` of the examples with a detector: `--detector FILE.onnx` detects things in the images.
//!
//! `cargo run --release --manifest-path examples/detect/Cargo.toml --bin build_map -- --dataset DIR --detector yolox_nano.onnx
//! [--detector-names FILE] ...`

use std::path::Path;

use dymlm_detect::{Yolox, YoloxConfig};
use dymlm_examples::{AnyError, Failure, FrameDetector, build_map};

fn main() -> Result<(), Failure> {
    Ok(build_map(Some(&open_detector))?)
}

fn open_detector(path: &Path, names: Option<&Path>) -> Result<Box<dyn FrameDetector>, AnyError> {
    let mut config = YoloxConfig::default();
    if let Some(names) = names {
        config.class_names = dymlm_io::read_class_names(names)?;
    }
    Ok(Box::new(Yolox::open(path, config)?))
}
