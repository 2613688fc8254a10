//! A copy that follows a map by its changes: the copy's leaves outside the cubes and the map's leaves inside them
//! together are the map.

use crate::common::changes::{apply, changes, config};
use crate::common::one_leaf;
use dymlm_octree::{Extent, Leaf, Octree};
use proptest::prelude::*;

fn holds(cube: &Extent, leaf: &Leaf) -> bool {
    (0..3).all(|axis| cube.min[axis] < leaf.center[axis] && leaf.center[axis] < cube.max[axis])
}

/// A leaf without its colour, which is not compared.
fn plain(leaf: &Leaf) -> ([u16; 3], u8, f32) {
    (leaf.key, leaf.depth, leaf.log_odds)
}

/// Whether a copy of the earlier map is the map once it has followed the changes, and no cubes overlap.
fn follows(map: &Octree, earlier: &Octree) -> bool {
    let cubes = map.changes_since(earlier);
    let count = |leaf: &Leaf| cubes.iter().filter(|cube| holds(cube, leaf)).count();
    let outside = earlier.leaves().filter(|leaf| count(leaf) == 0);
    let inside = map.leaves().filter(|leaf| count(leaf) == 1);
    let mut copy: Vec<_> = outside.chain(inside).map(|leaf| plain(&leaf)).collect();
    let mut leaves: Vec<_> = map.leaves().map(|leaf| plain(&leaf)).collect();
    for leaves in [&mut copy, &mut leaves] {
        leaves.sort_by_key(|&(key, ..)| key);
    }
    copy == leaves && map.leaves().chain(earlier.leaves()).all(|leaf| count(&leaf) < 2)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_copy_that_follows_the_changes_is_the_map(changes in changes()) {
        let mut map = Octree::new(config(true)).unwrap();
        for change in &changes {
            let earlier = map.clone();
            apply(&mut map, change);
            prop_assert!(follows(&map, &earlier), "{:?}", change);
            prop_assert!(follows(&earlier, &map), "back from {:?}", change);
        }
    }
}

/// One cell, in the first block of the leaf or in its last, changes a leaf of any size.
#[test]
fn a_leaf_that_is_split_or_formed_is_one_cube() {
    const LOWEST: u16 = 32768;
    for depth in 0..=13 {
        let side = 1_u32 << (16 - depth);
        let key = if depth == 0 { [0; 3] } else { [LOWEST; 3] };
        let whole = one_leaf(0.1, key, depth, -2.0);
        for cell in [0, side - 1] {
            let place = key.map(|first| (f64::from(u32::from(first) + cell) - 32768.0 + 0.5) * 0.1);
            let mut split = whole.clone();
            split.set_log_odds(place, Some(1.0));
            for [now, before] in [[&split, &whole], [&whole, &split]] {
                let cubes = now.changes_since(before);
                assert_eq!(cubes.len(), 1, "depth {depth}, cell {cell}: {cubes:?}");
                assert!(
                    (cubes[0].max[0] - cubes[0].min[0] - f64::from(side) * 0.1).abs() < 1e-6,
                    "{cubes:?}"
                );
                assert!(now.leaves().all(|leaf| holds(&cubes[0], &leaf)), "depth {depth}: {cubes:?}");
            }
        }
    }
}

/// Another value, a leaf where nothing was known, and one that is forgotten: a cube each, and none for what is
/// beside it.
#[test]
fn a_leaf_that_changes_as_a_whole_is_one_cube() {
    let beside = one_leaf(0.1, [32768 + 32, 32768, 32768], 12, 1.0);
    let with = |leaf: Option<f32>| {
        let mut map = beside.clone();
        if let Some(log_odds) = leaf {
            map.merge(&one_leaf(0.1, [32768; 3], 11, log_odds)).unwrap();
        }
        map
    };
    let [unknown, free, occupied] = [None, Some(-2.0), Some(2.0)].map(with);
    for (now, before) in
        [(&free, &unknown), (&unknown, &free), (&occupied, &free), (&free, &occupied), (&occupied, &unknown)]
    {
        let cubes = now.changes_since(before);
        assert_eq!(cubes.len(), 1, "{cubes:?}");
        assert_eq!(cubes[0].min, [0.0; 3]);
        assert!(cubes[0].max.iter().all(|c| (c - 3.2).abs() < 1e-9), "{cubes:?}");
    }
}
