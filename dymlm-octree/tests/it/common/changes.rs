//! Random changes of a map.

use dymlm_octree::Octree;
use proptest::prelude::*;

/// A way to change a map.
#[derive(Debug, Clone)]
pub(crate) enum Change {
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

pub(crate) fn changes() -> impl Strategy<Value = Vec<Change>> {
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

pub(crate) fn apply(map: &mut Octree, change: &Change) {
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

pub(crate) fn file(map: &Octree) -> Vec<u8> {
    let mut bytes = Vec::new();
    map.write_ot(&mut bytes).unwrap();
    bytes
}
