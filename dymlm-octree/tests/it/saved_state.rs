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
