use super::branch::Entry;
use super::{ENTRIES, NO_COLOR, ROOT_LEVEL, Tree};
use crate::lattice::Key;

/// How much of a cube of cells is to be forgotten.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Forgotten {
    Nothing,
    Part,
    All,
}

impl Tree {
    /// Forgets cubes of cells, no smaller ones than blocks. `forgotten` is asked for cubes by their lowest
    /// cell and their side in cells. Freed nodes are used again by what comes.
    pub(crate) fn forget(&mut self, forgotten: &impl Fn(Key, u32) -> Forgotten) {
        self.forget_below(0, ROOT_LEVEL, [0; 3], forgotten);
    }

    /// At most five levels deep.
    fn forget_below(
        &mut self,
        node: u32,
        level: u8,
        corner: Key,
        forgotten: &impl Fn(Key, u32) -> Forgotten,
    ) {
        let side = 1_u32 << (3 * level);
        for entry in 0..ENTRIES {
            let old = self.branches[node as usize].entry(entry);
            if old == Entry::Unknown {
                continue;
            }
            let corner = corner_of(corner, entry, side);
            match forgotten(corner, side) {
                Forgotten::All => self.drop_entry(node, level, entry),
                Forgotten::Part if level > 1 => {
                    let child = match old {
                        Entry::Child(child) => child,
                        leaf => self.add_child(node, level, entry, leaf),
                    };
                    self.forget_below(child, level - 1, corner, forgotten);
                }
                Forgotten::Part | Forgotten::Nothing => {}
            }
        }
        self.settle_node(node, level);
    }

    /// Makes an entry unknown, and frees all nodes below it.
    fn drop_entry(&mut self, node: u32, level: u8, entry: usize) {
        if let Entry::Child(child) = self.branches[node as usize].entry(entry) {
            if level > 1 {
                (0..ENTRIES).for_each(|entry| self.drop_entry(child, level - 1, entry));
            }
            self.free_node(child, level - 1);
        }
        self.branches[node as usize].set(entry, Entry::Unknown);
        if let Some(colors) = &mut self.colors {
            colors.branches[node as usize][entry] = NO_COLOR;
        }
    }
}

/// The lowest cell of an entry of a node that begins at `corner`, with entries of so many cells a side.
pub(super) fn corner_of(corner: Key, entry: usize, side: u32) -> Key {
    let step = entry_steps(entry);
    [0, 1, 2].map(|axis| (u32::from(corner[axis]) + u32::from(step[axis]) * side) as u16)
}

/// Where an entry lies in its node: what [`entry_of`](super::entry_of) makes an entry of.
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
