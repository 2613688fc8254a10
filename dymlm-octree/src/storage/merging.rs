use std::sync::Arc;

use dymlm_core::Rgb;

use super::colors::blended;
use super::{Block, Branch, ENTRIES, Entry, Tree, for_each_bit};
use crate::occupancy_model::OccupancyModel;

impl Tree {
    /// Adds another map's log-odds cell by cell, as independent evidence; colours are blended half and half,
    /// where this map has colours.
    pub(crate) fn merge(&mut self, other: &Self, model: &OccupancyModel) {
        let merging = Merging { model, has_colors: self.has_colors() };
        let root = self.root_mut();
        merging.add_branch(root, other.root());
        root.settle_all();
    }
}

/// How evidence is added.
#[derive(Clone, Copy)]
struct Merging<'a> {
    model: &'a OccupancyModel,
    has_colors: bool,
}

impl Merging<'_> {
    /// At most five levels deep.
    fn add_branch(self, ours: &mut Branch, theirs: &Branch) {
        for entry in 0..ENTRIES {
            match theirs.entry(entry) {
                Entry::Unknown => {}
                Entry::Leaf(log_odds) => self.add_to_entry(ours, entry, *log_odds, theirs.colors.at(entry)),
                Entry::Block(theirs) => {
                    if let Entry::Block(ours) = ours.parted(entry) {
                        self.add_block(Arc::make_mut(ours), theirs);
                    }
                }
                Entry::Branch(theirs) => {
                    if let Entry::Branch(ours) = ours.parted(entry) {
                        self.add_branch(Arc::make_mut(ours), theirs);
                    }
                }
            }
        }
    }

    fn add_block(self, ours: &mut Block, theirs: &Block) {
        for_each_bit(&theirs.known, |entry| {
            let sum = ours.cells.get(entry) + theirs.cells.get(entry);
            ours.cells.set(entry, Some(self.model.clamped(sum)));
        });
        for (ours, theirs) in ours.known.iter_mut().zip(&theirs.known) {
            *ours |= theirs;
        }
        if self.has_colors {
            for entry in 0..ENTRIES {
                ours.colors.set(entry, blended(ours.colors.at(entry), theirs.colors.at(entry)));
            }
        }
    }

    /// Adds the same log-odds to all cells below an entry, and blends a colour with those of all leaves
    /// there. At most five levels deep.
    fn add_to_entry(self, branch: &mut Branch, entry: usize, update: f32, color: Rgb) {
        let value = match branch.entry_mut(entry) {
            Entry::Unknown => update,
            Entry::Leaf(value) => *value + update,
            Entry::Block(block) => return self.add_to_block(Arc::make_mut(block), update, color),
            Entry::Branch(below) => {
                let below = Arc::make_mut(below);
                return (0..ENTRIES).for_each(|entry| self.add_to_entry(below, entry, update, color));
            }
        };
        branch.set(entry, Entry::Leaf(self.model.clamped(value)));
        if self.has_colors {
            branch.colors.set(entry, blended(branch.colors.at(entry), color));
        }
    }

    fn add_to_block(self, block: &mut Block, update: f32, color: Rgb) {
        block.known = [u64::MAX; 8];
        block.cells.change(&block.known, |value| self.model.clamped(value + update));
        if self.has_colors {
            for entry in 0..ENTRIES {
                block.colors.set(entry, blended(block.colors.at(entry), color));
            }
        }
    }
}
