use std::sync::LazyLock;

use dymlm::MapBuilder;
use dymlm_core::{FrameId, Pose};

use crate::choices::Choices;
use crate::fingerprint::fingerprint_without_ids;
use crate::walk::MAP;

static UNMOVED: LazyLock<Vec<u8>> = LazyLock::new(|| fingerprint_without_ids(&MAP));

fn poses(builder: &MapBuilder) -> Vec<(FrameId, Pose)> {
    builder.trajectory().map(|(id, _, pose)| (id, pose)).collect()
}

/// Poses of a walk are corrected arbitrarily, several times. Only the last poses must count, and correcting
/// back to the first poses must give the first maps.
pub fn correct_poses(bytes: &[u8]) {
    let mut choices = Choices::new(bytes);
    let mut builder = MapBuilder::resume(MAP.clone()).unwrap();
    let right = poses(&builder);
    for _ in 0..3 {
        if choices.is_over() {
            break;
        }
        let moved = |(id, pose)| choices.is_true().then(|| (id, choices.pose() * pose));
        let given: Vec<(FrameId, Pose)> = poses(&builder).into_iter().filter_map(moved).collect();
        let before = builder.map().clone();
        if builder.correct_poses(&given).is_ok() {
            let now = poses(&builder);
            assert!(given.iter().all(|given| now.contains(given)));
        } else {
            assert_eq!(builder.map().counts(), before.counts(), "what was refused has changed the maps");
        }
    }
    let mut at_once = MapBuilder::resume(MAP.clone()).unwrap();
    at_once.correct_poses(&poses(&builder)).unwrap();
    let [one, other] = [&builder, &at_once].map(|builder| fingerprint_without_ids(builder.map()));
    assert!(one == other, "earlier poses count too");
    builder.correct_poses(&right).unwrap();
    assert_eq!(poses(&builder), right);
    assert!(fingerprint_without_ids(builder.map()) == *UNMOVED, "corrected back, the maps are others");
}
