//! Storage of the cells: a tree of nodes with 8 x 8 x 8 entries, that is three octree levels per node. Clones
//! share nodes, which are copied when they change.
//!
//! A node of level L has entries that cover `2^(3 L)` cells along each axis: blocks (level 0) hold cells,
//! branches (levels 1 to 5) hold children or leaves larger than a cell, and the root (level 5) uses its first
//! eight entries. Entries are in Morton order, so that the eight children of an octree node are eight
//! neighbours in memory, and eight bits of a mask.
//!
//! From outside this is an octree of 16 levels that is always pruned: [`Subtree`] shows it as such. Two rules
//! hold between calls. No node but the root is empty or is one single leaf. `max` of a node is the largest
//! log-odds below it.

mod block;
mod branch;
mod cells;
mod colors;
mod difference;
mod filling;
mod forgetting;
mod merging;
#[cfg(feature = "state")]
mod saving;
mod subtree;
mod tree;

use block::Block;
pub(crate) use branch::{Branch, Entry};
pub(crate) use filling::SubtreeToFill;
pub(crate) use forgetting::Forgotten;
pub(crate) use subtree::{Kind, Subtree, child_corner};
pub(crate) use tree::Tree;

use dymlm_core::Rgb;

use crate::lattice::Key;

/// Entries of a node.
pub(crate) const ENTRIES: usize = 512;

/// Level of the root.
pub(crate) const ROOT_LEVEL: u8 = 5;

/// One bit for each entry of a node.
pub(crate) type Bits = [u64; 8];

/// What OctoMap takes for "no colour yet".
pub(crate) const NO_COLOR: Rgb = [255; 3];

/// The bits 0, 1, 2 of an index spread to the places 0, 3, 6.
const SPREAD: [usize; 8] = [0, 1, 8, 9, 64, 65, 72, 73];

/// The entry of a node of the given level that covers a cell.
#[inline]
pub(crate) fn entry_of(key: Key, level: u8) -> usize {
    let [x, y, z] = key.map(|index| SPREAD[usize::from(index) >> (3 * level) & 7]);
    // The remainder is the number itself; with it the compiler knows the range.
    (x | y << 1 | z << 2) % ENTRIES
}

/// Bytes of something behind an `Arc`, with its two counts.
fn shared_bytes<T>() -> usize {
    size_of::<T>() + 2 * size_of::<usize>()
}

#[inline]
pub(crate) fn has(bits: &Bits, entry: usize) -> bool {
    bits[entry / 64] >> (entry % 64) & 1 != 0
}

/// Calls `f` with each entry whose bit is set, in ascending order.
#[inline]
pub(crate) fn for_each_bit(bits: &Bits, mut f: impl FnMut(usize)) {
    for (i, &word) in bits.iter().enumerate() {
        let mut rest = word;
        while rest != 0 {
            f(i * 64 + rest.trailing_zeros() as usize);
            rest &= rest - 1;
        }
    }
}

/// OctoMap's colour of a parent: the mean colour of those of its children that have one.
pub(crate) fn mean_color(colors: impl Iterator<Item = Rgb>) -> Rgb {
    let mut sum = [0_u64; 3];
    let mut count = 0;
    for color in colors.filter(|&color| color != NO_COLOR) {
        for (sum, channel) in sum.iter_mut().zip(color) {
            *sum += u64::from(channel);
        }
        count += 1;
    }
    if count == 0 { NO_COLOR } else { sum.map(|sum| (sum / count) as u8) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_are_in_morton_order() {
        assert_eq!(entry_of([1, 0, 0], 0), 1);
        assert_eq!(entry_of([0, 1, 0], 0), 2);
        assert_eq!(entry_of([0, 0, 4], 0), 256);
        // Bits z y x of the half, the quarter, the cell.
        assert_eq!(entry_of([5, 2, 3], 0), 0b001_110_101);
    }
}
