//! What tests of oriented boxes share.

use dymlm_core::Pose;
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
