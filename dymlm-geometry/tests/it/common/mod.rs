//! What several tests share.

use dymlm_core::{Point, Pose};
use proptest::prelude::*;

/// Motions within a few metres.
pub(crate) fn poses() -> impl Strategy<Value = Pose> {
    (prop::array::uniform4(-1.0..1.0_f64), prop::array::uniform3(-3.0..3.0_f64)).prop_filter_map(
        "no rotation",
        |(quaternion, translation)| {
            let norm = quaternion.iter().map(|q| q * q).sum::<f64>().sqrt();
            (norm > 0.1).then(|| Pose::new(translation, quaternion.map(|q| q / norm)).unwrap())
        },
    )
}

/// A file of `tests/data`.
pub(crate) fn data(name: &str) -> String {
    std::fs::read_to_string(format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
}

/// The 1,500 points for which other libraries gave the answers beside them (`tests/data/make_golden.py`).
pub(crate) fn golden_points() -> Vec<Point> {
    let point = |line: &str| -> Point {
        let values: Vec<f32> = line.split(',').map(|value| value.parse().unwrap()).collect();
        values.try_into().unwrap()
    };
    data("points.csv").lines().map(point).collect()
}
