use std::sync::Arc;

use super::forgetting::corner_of;
use super::{Branch, ENTRIES, Entry, Tree};
use crate::lattice::Key;

impl Tree {
    /// Calls `visit` with the lowest cell and the side, in cells, of each cube in which two trees differ: cubes
    /// of one block, or larger ones that are one leaf or unknown in either tree, so that no leaf of either tree
    /// lies partly in a cube. Cubes do not overlap. Colours are not compared. Nodes that the trees share are
    /// skipped.
    pub(crate) fn for_each_difference(&self, other: &Self, visit: &mut impl FnMut(Key, u32)) {
        compare_below(self.root(), other.root(), [0; 3], visit);
    }
}

/// At most five levels deep.
fn compare_below(own: &Branch, other: &Branch, corner: Key, visit: &mut impl FnMut(Key, u32)) {
    if std::ptr::eq(own, other) {
        return;
    }
    let side = 1_u32 << (3 * own.level);
    let mut entry = 0;
    while entry < ENTRIES {
        let is_same = match (own.entry(entry), other.entry(entry)) {
            (Entry::Branch(own), Entry::Branch(other)) => {
                compare_below(own, other, corner_of(corner, entry, side), visit);
                true
            }
            (Entry::Block(own), Entry::Block(other)) => {
                Arc::ptr_eq(own, other) || (0..ENTRIES).all(|entry| own.cell(entry) == other.cell(entry))
            }
            (Entry::Leaf(own), Entry::Leaf(other)) => own == other,
            (Entry::Unknown, Entry::Unknown) => true,
            _ => false,
        };
        if is_same {
            entry += 1;
        } else {
            // Entries before this one in its leaf, if there are any, do not differ: none of them was visited.
            let log8 = own.leaf_log8(entry).max(other.leaf_log8(entry));
            let first = entry >> (3 * log8) << (3 * log8);
            visit(corner_of(corner, first, side), side << log8);
            entry = first + (1 << (3 * log8));
        }
    }
}
