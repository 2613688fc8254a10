//! Clones share what neither has changed since, and nothing else.

#![allow(clippy::unwrap_used, reason = "tests")]

use dymlm_octree::{Octree, OctreeConfig};
use proptest::prelude::*;

/// A way to change a map.
#[derive(Debug, Clone)]
enum Change {
    Scan([f64; 3], Vec<[f32; 3]>),
    Set([f64; 3], Option<f32>),
    ForgetOutside([f64; 3], f64),
    Merge,
    ToMaxLikelihood,
    Clear,
}

fn place() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-4.0..4.0_f64)
}

fn changes() -> impl Strategy<Value = Vec<Change>> {
    let points = prop::collection::vec(prop::array::uniform3(-4.0..4.0_f32), 1..20);
    let change = prop_oneof![
        8 => (place(), points).prop_map(|(origin, points)| Change::Scan(origin, points)),
        4 => (place(), prop::option::of(-2.0..3.0_f32)).prop_map(|(at, value)| Change::Set(at, value)),
        2 => (place(), 0.5..5.0_f64).prop_map(|(center, radius)| Change::ForgetOutside(center, radius)),
        1 => Just(Change::Merge),
        1 => Just(Change::ToMaxLikelihood),
        1 => Just(Change::Clear),
    ];
    prop::collection::vec(change, 1..10)
}

fn apply(map: &mut Octree, change: &Change) {
    match change {
        Change::Scan(origin, points) => {
            let colors: Vec<[u8; 3]> = points.iter().map(|point| point.map(|c| (c * 30.0) as u8)).collect();
            map.insert_scan_colored(*origin, points, &colors).unwrap();
        }
        Change::Set(at, value) => map.set_log_odds(*at, *value),
        Change::ForgetOutside(center, radius) => map.forget_outside(*center, *radius),
        Change::Merge => map.merge(&map.clone()).unwrap(),
        Change::ToMaxLikelihood => map.to_max_likelihood(),
        Change::Clear => map.clear(),
    }
}

fn file(map: &Octree) -> Vec<u8> {
    let mut bytes = Vec::new();
    map.write_ot(&mut bytes).unwrap();
    bytes
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_map_changes_as_if_nobody_had_a_clone_and_no_clone_changes(changes in changes()) {
        let mut config = OctreeConfig::default();
        (config.resolution, config.color) = (0.1, true);
        let (mut shared, mut alone) = (Octree::new(config.clone()).unwrap(), Octree::new(config).unwrap());
        let mut clones = Vec::new();
        for change in &changes {
            let clone = shared.clone();
            apply(&mut shared, change);
            apply(&mut alone, change);
            prop_assert!(file(&shared) == file(&alone));
            prop_assert!(shared.changes_since(&clone) == alone.changes_since(&clone));
            let before = file(&clone);
            clones.push((clone, before));
        }
        prop_assert!(clones.iter().all(|(clone, before)| file(clone) == *before));
    }
}
