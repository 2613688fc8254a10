use std::sync::Arc;

use super::{Branch, ENTRIES, Entry, NO_COLOR, Tree};
use crate::lattice::Key;

/// How much of a cube of cells is to be forgotten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Forgotten {
    Nothing,
    Part,
    All,
}

impl Tree {
    /// Forgets cubes of cells, none smaller than a block. `forgotten` is called with a cube's lowest cell and
    /// its side in cells.
    pub(crate) fn forget(&mut self, forgotten: &impl Fn(Key, u32) -> Forgotten) {
        forget_below(self.root_mut(), [0; 3], forgotten);
    }
}

/// At most five levels deep.
fn forget_below(branch: &mut Branch, corner: Key, forgotten: &impl Fn(Key, u32) -> Forgotten) {
    let side = 1_u32 << (3 * branch.level);
    for entry in 0..ENTRIES {
        if matches!(branch.entry(entry), Entry::Unknown) {
            continue;
        }
        let corner = corner_of(corner, entry, side);
        match forgotten(corner, side) {
            Forgotten::All => {
                branch.set(entry, Entry::Unknown);
                branch.colors.set(entry, NO_COLOR);
            }
            Forgotten::Part if branch.level > 1 => {
                if let Entry::Branch(below) = branch.parted(entry) {
                    forget_below(Arc::make_mut(below), corner, forgotten);
                }
            }
            Forgotten::Part | Forgotten::Nothing => {}
        }
    }
    branch.settle();
}

/// The lowest cell of an entry of a node that begins at `corner`, with entries of `side` cells a side.
pub(super) fn corner_of(corner: Key, entry: usize, side: u32) -> Key {
    let step = entry_steps(entry);
    [0, 1, 2].map(|axis| (u32::from(corner[axis]) + u32::from(step[axis]) * side) as u16)
}

/// Indices of an entry along x, y, z in its node: the inverse of [`entry_of`](super::entry_of).
fn entry_steps(entry: usize) -> Key {
    [0, 1, 2].map(|axis| {
        let bit = |place: usize| (entry >> (3 * place + axis) & 1) << place;
        (bit(0) | bit(1) | bit(2)) as u16
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storage::entry_of;

    #[test]
    fn the_steps_of_an_entry_lead_to_it() {
        assert!((0..ENTRIES).all(|entry| entry_of(entry_steps(entry), 0) == entry));
    }
}
