//! Occupied cells that are made free by boxes.

use std::cell::Cell;

use crate::common::changes::{apply, changes};
use crate::common::one_leaf;
use dymlm_octree::{CellState, Octree, OctreeConfig};
use proptest::prelude::*;

/// Of a leaf with up to 2.8e14 cells only the few in the box are looked at, as this test ends.
#[test]
fn a_box_within_a_vast_leaf_costs_what_it_holds() {
    for (depth, key) in [(0, [0; 3]), (1, [32768; 3]), (2, [32768; 3])] {
        let mut map = one_leaf(0.05, key, depth, 2.0);
        let asked = Cell::new(0);
        let freed = map.free_cells([[[10.01; 3], [10.11; 3]]], |_| {
            asked.set(asked.get() + 1);
            true
        });
        assert_eq!((freed, asked.get()), (27, 27), "depth {depth}");
        assert_eq!(map.state([10.06; 3]), CellState::Free);
        assert_eq!(map.state([10.16; 3]), CellState::Occupied);
        assert_eq!(map.state([9.99; 3]), CellState::Occupied);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Whatever leaves the map has. Corners lie on borders of cells as well.
    #[test]
    fn the_occupied_cells_of_a_box_become_free_and_no_others(
        changes in changes(),
        first in prop::array::uniform3(-20..20_i32),
        size in prop::array::uniform3(0..12_i32),
        part in prop::sample::select(vec![0.0, 0.3]),
    ) {
        let mut config = OctreeConfig::default();
        // A power of two, so that borders of cells have no rounding.
        config.resolution = 0.125;
        let mut map = Octree::new(config).unwrap();
        for change in &changes {
            apply(&mut map, change);
        }
        let before = map.clone();
        let place = |cell: i32, part: f64| (f64::from(cell) + part) * 0.125;
        let min = first.map(|cell| place(cell, part));
        let max: [f64; 3] = std::array::from_fn(|axis| place(first[axis] + size[axis], part));
        let freed = map.free_cells([[min, max]], |center| center[0] < 1.0);
        let mut expected = before.clone();
        let mut count = 0;
        let miss = (0.4_f64 / 0.6).ln() as f32;
        for x in first[0]..=first[0] + size[0] {
            for y in first[1]..=first[1] + size[1] {
                for z in first[2]..=first[2] + size[2] {
                    let center = [x, y, z].map(|cell| place(cell, 0.5));
                    if before.state(center) == CellState::Occupied && center[0] < 1.0 {
                        expected.set_log_odds(center, Some(miss));
                        count += 1;
                    }
                }
            }
        }
        prop_assert_eq!(freed, count);
        prop_assert!(map.changes_since(&expected).is_empty());
    }
}
