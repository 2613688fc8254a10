//! Random changes of a map.

use super::{Key, one_leaf};
use dymlm_octree::{Octree, OctreeConfig};
use proptest::prelude::*;

/// A way to change a map.
#[derive(Debug, Clone)]
pub(crate) enum Change {
    Scan([f64; 3], Vec<[f32; 3]>),
    Set([f64; 3], Option<f32>),
    ForgetOutside([f64; 3], f64),
    Merge,
    /// Merges a map of one leaf: the lowest cell of the leaf, its depth, its log-odds.
    Cube(Key, u8, f32),
    ToMaxLikelihood,
    Clear,
}

/// The config of maps that are changed so, with colours or without.
pub(crate) fn config(color: bool) -> OctreeConfig {
    let mut config = OctreeConfig::default();
    (config.resolution, config.color) = (0.1, color);
    config
}

fn place() -> impl Strategy<Value = [f64; 3]> {
    prop::array::uniform3(-4.0..4.0_f64)
}

/// Leaves of 1 to 64 cells a side around the world's origin, mostly with log-odds that other changes lead to as well.
fn cube() -> impl Strategy<Value = Change> {
    let log_odds = prop_oneof![Just(-2.0_f32), Just(3.5), Just(0.5)];
    (10..=16_u8, prop::array::uniform3(32768 - 64..32768 + 64_u16), log_odds).prop_map(
        |(depth, key, log_odds)| {
            let side = 1_u16 << (16 - depth);
            Change::Cube(key.map(|index| index / side * side), depth, log_odds)
        },
    )
}

pub(crate) fn changes() -> impl Strategy<Value = Vec<Change>> {
    let points = prop::collection::vec(prop::array::uniform3(-4.0..4.0_f32), 1..20);
    let change = prop_oneof![
        8 => (place(), points).prop_map(|(origin, points)| Change::Scan(origin, points)),
        4 => (place(), prop::option::of(-2.0..3.0_f32)).prop_map(|(at, value)| Change::Set(at, value)),
        2 => (place(), 0.5..5.0_f64).prop_map(|(center, radius)| Change::ForgetOutside(center, radius)),
        1 => Just(Change::Merge),
        4 => cube(),
        1 => Just(Change::ToMaxLikelihood),
        1 => Just(Change::Clear),
    ];
    prop::collection::vec(change, 1..10)
}

pub(crate) fn apply(map: &mut Octree, change: &Change) {
    match change {
        Change::Scan(origin, points) => {
            let colors: Vec<[u8; 3]> = points.iter().map(|point| point.map(|c| (c * 30.0) as u8)).collect();
            map.insert_scan_colored(*origin, points, &colors).unwrap();
        }
        Change::Set(at, value) => map.set_log_odds(*at, *value),
        Change::ForgetOutside(center, radius) => map.forget_outside(*center, *radius),
        Change::Merge => map.merge(&map.clone()).unwrap(),
        Change::Cube(key, depth, log_odds) => {
            map.merge(&one_leaf(map.resolution(), *key, *depth, *log_odds)).unwrap();
        }
        Change::ToMaxLikelihood => map.to_max_likelihood(),
        Change::Clear => map.clear(),
    }
}

pub(crate) fn file(map: &Octree) -> Vec<u8> {
    let mut bytes = Vec::new();
    map.write_ot(&mut bytes).unwrap();
    bytes
}
