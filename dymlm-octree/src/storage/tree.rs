use std::sync::Arc;

use dymlm_core::Rgb;

use super::colors::averaged;
use super::{Bits, Block, Branch, Entry, NO_COLOR, ROOT_LEVEL, entry_of};
use crate::lattice::Key;
use crate::occupancy_model::OccupancyModel;

/// The tree of nodes. A clone costs one pointer: both trees share their nodes, and a tree copies shared
/// nodes, and the branches above them, before it changes them.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    root: Arc<Branch>,
    /// Whether leaves carry colours.
    has_colors: bool,
    /// Scratch of [`Self::observe`]: keys >> 6 of the level-1 branches that changed.
    touched: Vec<Key>,
}

/// Queries.
impl Tree {
    pub(crate) fn new(has_colors: bool) -> Self {
        Self { root: Arc::new(Branch::empty(ROOT_LEVEL)), has_colors, touched: Vec::new() }
    }

    pub(crate) fn has_colors(&self) -> bool {
        self.has_colors
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.root.is_empty()
    }

    #[inline]
    pub(crate) fn root(&self) -> &Branch {
        &self.root
    }

    /// Bytes held that another tree does not share.
    pub(crate) fn memory_bytes_beside(&self, other: Option<&Self>) -> usize {
        let touched = self.touched.capacity() * size_of::<Key>();
        match other {
            Some(other) if Arc::ptr_eq(&self.root, &other.root) => touched,
            _ => {
                let nodes = self.root.memory_bytes_beside(other.map(|other| &*other.root));
                super::shared_bytes::<Branch>() + nodes + touched
            }
        }
    }

    /// The entry that covers a cell in the branch of a level, or the leaf or the unknown space above.
    #[inline]
    pub(crate) fn entry(&self, key: Key, level: u8) -> &Entry {
        let mut entry = self.root.entry(entry_of(key, ROOT_LEVEL));
        for below in (level..ROOT_LEVEL).rev() {
            let Entry::Branch(branch) = entry else { break };
            entry = branch.entry(entry_of(key, below));
        }
        entry
    }

    /// log2 of the side, in cells, of the entry around a cell: a leaf, unknown space or a block.
    pub(crate) fn side_bits(&self, key: Key) -> u32 {
        let mut level = ROOT_LEVEL;
        let mut entry = self.root.entry(entry_of(key, level));
        while let Entry::Branch(branch) = entry {
            level = branch.level;
            entry = branch.entry(entry_of(key, level));
        }
        3 * u32::from(level)
    }

    /// The log-odds of a cell; `None` where nothing is known.
    #[inline]
    pub(crate) fn log_odds(&self, key: Key) -> Option<f32> {
        self.entry(key, 1).log_odds(key)
    }

    /// The colour of a cell; [`NO_COLOR`] without one.
    pub(crate) fn cell_color(&self, key: Key) -> Rgb {
        let mut branch = &*self.root;
        loop {
            let entry = entry_of(key, branch.level);
            match branch.entry(entry) {
                Entry::Unknown => return NO_COLOR,
                Entry::Leaf(_) => return branch.colors.at(entry),
                Entry::Block(block) => return block.colors.at(entry_of(key, 0)),
                Entry::Branch(below) => branch = below,
            }
        }
    }
}

impl Entry {
    /// The entry of this branch that covers a cell; `self` if it is no branch.
    #[inline]
    pub(crate) fn below(&self, key: Key) -> &Self {
        match self {
            Self::Branch(branch) => branch.entry(entry_of(key, branch.level)),
            _ => self,
        }
    }

    /// The log-odds of a cell in a block or a leaf; `None` where nothing is known, and for a branch.
    #[inline]
    pub(crate) fn log_odds(&self, key: Key) -> Option<f32> {
        // The usual case first: one comparison rather than a table of jumps.
        if let Self::Block(block) = self {
            return block.cell(entry_of(key, 0));
        }
        if let Self::Leaf(log_odds) = self { Some(*log_odds) } else { None }
    }
}

/// Changing cells.
impl Tree {
    /// Forgets everything.
    pub(crate) fn clear(&mut self) {
        self.root = Arc::new(Branch::empty(ROOT_LEVEL));
    }

    pub(super) fn root_mut(&mut self) -> &mut Branch {
        Arc::make_mut(&mut self.root)
    }

    /// Gives each chosen cell of the block that begins at `corner` one observation. To be followed by
    /// [`Self::settle`] once all blocks are done.
    pub(crate) fn observe(&mut self, corner: Key, misses: &Bits, hits: &Bits, model: &OccupancyModel) {
        let missed = misses.iter().any(|&word| word != 0);
        let hit = hits.iter().any(|&word| word != 0);
        let is_unmoved = |log_odds: f32| {
            (!missed || model.updated(log_odds, model.miss) == log_odds)
                && (!hit || model.updated(log_odds, model.hit) == log_odds)
        };
        // What stays as it is stays shared with clones of the map, and is not saved again.
        let stays = match self.entry(corner, 1) {
            Entry::Block(block) => block.is_unmoved_by(misses, hits, model),
            Entry::Leaf(log_odds) => is_unmoved(*log_odds),
            Entry::Unknown | Entry::Branch(_) => false,
        };
        if stays {
            return;
        }
        let Some(block) = self.block_to_change(corner) else { return };
        block.observe(misses, hits, model);
        block.refresh();
        self.touch(corner);
    }

    /// Changes one cell's log-odds; `None` forgets the cell. To be followed by [`Self::settle`].
    pub(crate) fn change_cell(&mut self, key: Key, change: impl FnOnce(Option<f32>) -> Option<f32>) {
        let old = self.log_odds(key);
        let new = change(old);
        if new == old {
            return;
        }
        let Some(block) = self.block_to_change(key) else { return };
        block.set(entry_of(key, 0), new);
        block.refresh();
        self.touch(key);
    }

    /// OctoMap's `averageNodeColor`: half the old colour, half the new one.
    pub(crate) fn blend_color(&mut self, key: Key, color: Rgb) {
        if !self.has_colors {
            return;
        }
        let mut branch = self.root_mut();
        loop {
            let entry = entry_of(key, branch.level);
            let (colors, entry) = match branch.entry(entry) {
                Entry::Unknown => return,
                Entry::Leaf(_) => (&mut branch.colors, entry),
                Entry::Block(_) | Entry::Branch(_) => match branch.entry_mut(entry) {
                    Entry::Branch(below) => {
                        branch = Arc::make_mut(below);
                        continue;
                    }
                    Entry::Block(block) => (&mut Arc::make_mut(block).colors, entry_of(key, 0)),
                    Entry::Unknown | Entry::Leaf(_) => return,
                },
            };
            return colors.set(entry, averaged(colors.at(entry), color));
        }
    }

    /// The block around a cell, created if needed.
    fn block_to_change(&mut self, key: Key) -> Option<&mut Block> {
        let mut branch = self.root_mut();
        loop {
            let entry = entry_of(key, branch.level);
            match branch.parted(entry) {
                Entry::Branch(below) => branch = Arc::make_mut(below),
                Entry::Block(block) => return Some(Arc::make_mut(block)),
                Entry::Unknown | Entry::Leaf(_) => return None,
            }
        }
    }

    fn touch(&mut self, key: Key) {
        let key = key.map(|index| index >> 6);
        if self.touched.last() != Some(&key) {
            self.touched.push(key);
        }
    }

    /// Restores the two rules (see the module) above all blocks that changed.
    pub(crate) fn settle(&mut self) {
        let mut touched = std::mem::take(&mut self.touched);
        for level in 1..=ROOT_LEVEL {
            touched.sort_unstable();
            touched.dedup();
            for key in &mut touched {
                if let Some(branch) = self.branch_to_settle(*key, level) {
                    branch.settle();
                }
                *key = key.map(|index| index >> 3);
            }
        }
        touched.clear();
        self.touched = touched;
    }

    /// The branch of a level whose cells have keys that begin with `prefix`.
    fn branch_to_settle(&mut self, prefix: Key, level: u8) -> Option<&mut Branch> {
        // The root's prefix has no bits left.
        let key = if level == ROOT_LEVEL { [0; 3] } else { prefix.map(|index| index << (3 * level + 3)) };
        let mut branch = self.root_mut();
        while branch.level > level {
            match branch.entry_mut(entry_of(key, branch.level)) {
                Entry::Branch(below) => branch = Arc::make_mut(below),
                _ => return None,
            }
        }
        Some(branch)
    }

    /// Changes every value, and settles all nodes.
    pub(crate) fn map_values(&mut self, f: impl Fn(f32) -> f32) {
        self.root_mut().map_values(&f);
        self.settle_all();
    }

    /// Restores the two rules everywhere.
    pub(crate) fn settle_all(&mut self) {
        self.root_mut().settle_all();
    }
}
