use super::branch::Entry;
use super::forgetting::corner_of;
use super::{ENTRIES, ROOT_LEVEL, Tree};
use crate::lattice::Key;

impl Tree {
    /// Calls `visit` for cubes of cells, by their lowest cell and their side in cells, in which two trees
    /// differ: the smallest that both trees part alike, no smaller than blocks. Colours are not compared.
    pub(crate) fn for_each_difference(&self, other: &Self, visit: &mut impl FnMut(Key, u32)) {
        self.compare_below([0, 0], other, ROOT_LEVEL, [0; 3], visit);
    }

    /// At most five levels deep.
    fn compare_below(
        &self,
        [own, others]: [u32; 2],
        other: &Self,
        level: u8,
        corner: Key,
        visit: &mut impl FnMut(Key, u32),
    ) {
        let (own, others) = (&self.branches[own as usize], &other.branches[others as usize]);
        let side = 1_u32 << (3 * level);
        for entry in 0..ENTRIES {
            match (own.entry(entry), others.entry(entry)) {
                (Entry::Child(a), Entry::Child(b)) if level > 1 => {
                    self.compare_below([a, b], other, level - 1, corner_of(corner, entry, side), visit);
                }
                (Entry::Child(a), Entry::Child(b)) => {
                    let (a, b) = (&self.blocks[a as usize], &other.blocks[b as usize]);
                    if (&a.known, &a.log_odds) != (&b.known, &b.log_odds) {
                        visit(corner_of(corner, entry, side), side);
                    }
                }
                (a, b) if a == b => {}
                _ => visit(corner_of(corner, entry, side), side),
            }
        }
    }
}
