use dymlm::{HistoryConfig, MapConfig, MultiLevelMap};
use dymlm_core::Pose;

use crate::calls::Calls;
use crate::choices::Choices;
use crate::fingerprint::fingerprint;

/// Maps of three sessions of arbitrary calls: merged in any order they must be the same, or the merge is
/// refused and changes nothing.
pub fn merge(bytes: &[u8]) {
    let mut config = MapConfig::default();
    config.history = HistoryConfig::Memory;
    config.cloud.voxel_size = 0.1;
    config.octree.resolution = 0.5;
    let third = bytes.len() / 3;
    let map = |place: usize| {
        let mut choices = Choices::new(&bytes[place * third..][..third]);
        // Sessions begin at different times: else they may be the same recording, of which the maps know
        // different parts.
        let mut calls = Calls::new(config.clone(), 1000.0 * f64::from(choices.byte()) + 0.01 * place as f64);
        calls.run(8, &mut choices);
        calls.builder.settle();
        calls.builder.map().clone()
    };
    let [a, b, c] = [0, 1, 2].map(map);
    let merged = |one: &MultiLevelMap, other: &MultiLevelMap| {
        let mut merged = one.clone();
        let report = merged.merge(other, &Pose::identity());
        if report.is_err() {
            assert_eq!(merged.counts(), one.counts(), "a refused merge has changed the maps");
        }
        report.ok().map(|_| merged)
    };
    let (Some(ab), Some(bc)) = (merged(&a, &b), merged(&b, &c)) else { return };
    let (one, other) = (merged(&ab, &c), merged(&bc, &a));
    assert_eq!(one.is_some(), other.is_some());
    if let Some((one, other)) = one.zip(other) {
        assert!(fingerprint(&one) == fingerprint(&other), "the order of merging counts");
        let again = merged(&one, &b).map(|again| fingerprint(&again) == fingerprint(&one));
        assert_eq!(again, Some(true), "what is there already is there twice");
    }
}
