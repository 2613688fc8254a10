use std::sync::Arc;

use super::forgetting::corner_of;
use super::{Branch, ENTRIES, Entry, Tree};
use crate::lattice::Key;

impl Tree {
    /// Calls `visit` with the lowest cell and the side, in cells, of each cube in which two trees differ: the
    /// smallest cubes that are an entry in both trees, none smaller than a block. Colours are not compared.
    /// Nodes that the trees share are skipped.
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
    for entry in 0..ENTRIES {
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
        if !is_same {
            visit(corner_of(corner, entry, side), side);
        }
    }
}
