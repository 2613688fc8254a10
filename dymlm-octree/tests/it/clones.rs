//! A map that is cloned changes as if it had no clones, and its clones do not change with it.

use crate::common::changes::{apply, changes, config, file};
use dymlm_octree::Octree;
use proptest::prelude::*;

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]

    #[test]
    fn a_map_changes_as_if_nobody_had_a_clone_and_no_clone_changes(changes in changes()) {
        let [mut shared, mut alone] = [(); 2].map(|()| Octree::new(config(true)).unwrap());
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
