//! A map saved in parts is restored bit by bit, and damaged parts do no harm.

#![cfg(feature = "state")]
use crate::common::changes::{apply, changes, config, file};
use dymlm_core::SplitMix64;
use dymlm_octree::{Error, Octree};
use dymlm_test_support::{SavedParts, damaged_parts, incomplete_parts, save_into, saved_parts};
use proptest::prelude::*;

fn whole(map: &Octree) -> SavedParts {
    saved_parts(|sink| map.save_state(None, sink))
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_saved_map_goes_on_as_if_it_had_not_been(
        color in any::<bool>(), before in changes(), after in changes(),
    ) {
        let mut map = Octree::new(config(color)).unwrap();
        let mut parts = whole(&map);
        for change in &before {
            let earlier = map.clone();
            apply(&mut map, change);
            save_into(&mut parts, |sink| map.save_state(Some(&earlier), sink));
        }
        prop_assert!(parts == whole(&map), "what has changed, applied one after the other, is the whole");
        let mut loaded = Octree::load_state(config(color), parts.clone().into_iter().rev()).unwrap();
        prop_assert!(file(&loaded) == file(&map) && whole(&loaded) == parts);
        for change in &after {
            apply(&mut map, change);
            apply(&mut loaded, change);
        }
        prop_assert!(file(&loaded) == file(&map) && whole(&loaded) == whole(&map));
    }

    #[test]
    fn what_is_no_saved_map_is_refused_or_harmless(changes in changes(), seed in any::<u64>()) {
        let mut map = Octree::new(config(true)).unwrap();
        for change in &changes {
            apply(&mut map, change);
        }
        let mut random = SplitMix64::new(seed);
        for _ in 0..20 {
            let parts = damaged_parts(&whole(&map), &mut random);
            if let Ok(mut damaged) = Octree::load_state(config(true), parts) {
                for change in &changes {
                    apply(&mut damaged, change);
                }
                file(&damaged);
            }
        }
    }
}

#[test]
fn parts_that_are_missing_or_too_many_are_named() {
    let mut map = Octree::new(config(false)).unwrap();
    map.insert_scan([0.0; 3], &[[2.0, 0.0, 0.0], [0.0, 9.0, 0.0]]).unwrap();
    for (part, [without, twice]) in incomplete_parts(&whole(&map)) {
        let load = |parts| Octree::load_state(config(false), parts).unwrap_err();
        assert!(
            matches!(load(without), Error::State(damaged) if damaged.what == "it is missing"),
            "{part:#x}"
        );
        assert!(matches!(load(twice), Error::State(damaged) if damaged.part == part));
    }
    assert!(matches!(Octree::load_state(config(false), []), Err(Error::State(_))));
}

#[test]
fn an_empty_map_and_one_cell() {
    let mut map = Octree::new(config(false)).unwrap();
    assert!(Octree::load_state(config(false), whole(&map)).unwrap().is_empty());
    map.set_log_odds([1.0, 2.0, 3.0], Some(1.5));
    let loaded = Octree::load_state(config(false), whole(&map)).unwrap();
    assert_eq!(loaded.log_odds([1.0, 2.0, 3.0]), Some(1.5));
    assert_eq!(file(&loaded), file(&map));
}

/// A wall before a scanner, inserted so often that its cells have reached the model's limits.
fn saturated_wall() -> (Octree, Vec<[f32; 3]>) {
    let wall: Vec<[f32; 3]> =
        (0..10_000).map(|i| [3.02, (i % 100) as f32 * 0.05 - 2.5, (i / 100) as f32 * 0.05 - 2.5]).collect();
    let mut map = Octree::new(config(false)).unwrap();
    for _ in 0..30 {
        map.insert_scan([0.01; 3], &wall).unwrap();
    }
    (map, wall)
}

fn changed_parts(map: &Octree, earlier: &Octree) -> usize {
    saved_parts(|sink| map.save_state(Some(earlier), sink)).len()
}

/// Regression: a camera at rest copied all blocks in view for each clone, and all of them were saved again.
#[test]
fn a_scan_that_changes_nothing_copies_and_saves_nothing() {
    let (mut map, wall) = saturated_wall();
    let earlier = map.clone();
    map.insert_scan([0.01; 3], &wall).unwrap();
    assert!(map.changes_since(&earlier).is_empty());
    assert_eq!(changed_parts(&map, &earlier), 0);
    // What does change is saved.
    map.insert_scan([0.01; 3], &[[1.5, 0.0, 0.0]]).unwrap();
    assert!(changed_parts(&map, &earlier) > 0);
}

/// Regression: merging one cell copied the whole of a map that has a clone.
#[test]
fn merging_one_cell_leaves_the_rest_shared() {
    let (mut map, _) = saturated_wall();
    let mut other = Octree::new(config(false)).unwrap();
    other.set_log_odds([3.0, 0.0, 0.0], Some(-1.0));
    let earlier = map.clone();
    map.merge(&other).unwrap();
    assert_eq!(map.changes_since(&earlier).len(), 1);
    // The group of blocks that the cell is in, and the branches above.
    assert!(changed_parts(&map, &earlier) < 6);
}
