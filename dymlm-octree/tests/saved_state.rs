//! A map in parts comes back to the bit, and bad parts do no harm.

#![cfg(feature = "state")]
#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use std::collections::BTreeMap;

use common::changes::{apply, changes, file};
use dymlm_core::SplitMix64;
use dymlm_octree::{Error, Octree, OctreeConfig};
use proptest::prelude::*;

type Parts = BTreeMap<u64, Vec<u8>>;

fn config(color: bool) -> OctreeConfig {
    let mut config = OctreeConfig::default();
    (config.resolution, config.color) = (0.1, color);
    config
}

/// Applies what differs from an earlier map; gives the number of parts.
fn save(map: &Octree, earlier: Option<&Octree>, parts: &mut Parts) -> usize {
    let mut changed = 0;
    let mut sink = |part, bytes: Option<&[u8]>| {
        changed += 1;
        match bytes {
            Some(bytes) => drop(parts.insert(part, bytes.to_vec())),
            None => assert!(parts.remove(&part).is_some(), "{part:#x} was not there"),
        }
        Ok(())
    };
    map.save_state(earlier, &mut sink).unwrap();
    changed
}

fn whole(map: &Octree) -> Parts {
    let mut parts = Parts::new();
    save(map, None, &mut parts);
    parts
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
            save(&map, Some(&earlier), &mut parts);
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
            let mut parts: Vec<(u64, Vec<u8>)> = whole(&map).into_iter().collect();
            let place = random.below(parts.len());
            match random.below(5) {
                0 => drop(parts.remove(place)),
                1 => parts.push(parts[place].clone()),
                2 => parts[place].0 ^= 1 << random.below(64),
                3 => {
                    let other = random.below(parts.len());
                    parts[place].1 = parts[other].1.clone();
                }
                _ => {
                    let bytes = &mut parts[place].1;
                    let at = random.below(bytes.len());
                    bytes[at] = random.below(256) as u8;
                }
            }
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
    let parts = whole(&map);
    for part in parts.keys().copied() {
        let without = parts.clone().into_iter().filter(|(key, _)| *key != part);
        let error = Octree::load_state(config(false), without).unwrap_err();
        assert!(matches!(&error, Error::State(damaged) if damaged.what == "it is missing"), "{error}");
        let twice = parts.clone().into_iter().chain([(part, parts[&part].clone())]);
        assert!(matches!(Octree::load_state(config(false), twice), Err(Error::State(_))));
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
