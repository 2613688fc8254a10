use dymlm_core::Rgb;

use super::branch::Entry;
use super::{Bits, Block, Branch, ENTRIES, NO_COLOR, ROOT_LEVEL, entry_of, for_each_bit, mean_color};
use crate::lattice::{DEPTH, Key};
use crate::occupancy_model::OccupancyModel;

/// The arenas. Nodes are named by their index; freed ones are used again.
#[derive(Debug, Clone)]
pub(crate) struct Tree {
    /// The root is branch 0.
    pub(super) branches: Vec<Branch>,
    pub(super) blocks: Vec<Block>,
    free_branches: Vec<u32>,
    free_blocks: Vec<u32>,
    /// Beside every node when leaves carry colours.
    pub(super) colors: Option<Colors>,
    /// Scratch of [`Self::observe`]: keys >> 6 of the level-1 branches that changed.
    touched: Vec<Key>,
}

/// A colour per entry, for each branch and each block.
#[derive(Debug, Clone, Default)]
pub(super) struct Colors {
    pub(super) branches: Vec<[Rgb; ENTRIES]>,
    pub(super) blocks: Vec<[Rgb; ENTRIES]>,
}

/// Where a cell's value is kept.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Place {
    /// Nothing is known of the 8^3 block around the cell.
    Unknown,
    /// A leaf that covers at least the 8^3 block around the cell has these log-odds.
    Leaf(f32),
    /// In this block.
    Block(u32),
}

impl Tree {
    pub(crate) fn new(colored: bool) -> Self {
        let colors = colored.then(|| Colors { branches: vec![[NO_COLOR; ENTRIES]], blocks: Vec::new() });
        Self {
            branches: vec![Branch::EMPTY],
            blocks: Vec::new(),
            free_branches: Vec::new(),
            free_blocks: Vec::new(),
            colors,
            touched: Vec::new(),
        }
    }

    pub(crate) fn has_colors(&self) -> bool {
        self.colors.is_some()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.branches[0].is_empty()
    }

    /// Forgets everything, and keeps the memory for what comes.
    pub(crate) fn clear(&mut self) {
        self.branches.truncate(1);
        self.branches[0] = Branch::EMPTY;
        self.blocks.clear();
        self.free_branches.clear();
        self.free_blocks.clear();
        if let Some(colors) = &mut self.colors {
            colors.branches.truncate(1);
            colors.branches[0] = [NO_COLOR; ENTRIES];
            colors.blocks.clear();
        }
    }

    /// Bytes held by the arenas.
    pub(crate) fn memory_bytes(&self) -> usize {
        let colors = self.colors.as_ref().map_or(0, |c| c.branches.capacity() + c.blocks.capacity());
        self.branches.capacity() * size_of::<Branch>()
            + self.blocks.capacity() * size_of::<Block>()
            + colors * size_of::<[Rgb; ENTRIES]>()
    }

    /// Where the values around a cell are kept.
    #[inline]
    pub(crate) fn place(&self, key: Key) -> Place {
        let mut branch = &self.branches[0];
        for level in (2..=ROOT_LEVEL).rev() {
            match branch.entry(entry_of(key, level)) {
                Entry::Child(child) => branch = &self.branches[child as usize],
                Entry::Leaf(log_odds) => return Place::Leaf(log_odds),
                Entry::Unknown => return Place::Unknown,
            }
        }
        match branch.entry(entry_of(key, 1)) {
            Entry::Child(block) => Place::Block(block),
            Entry::Leaf(log_odds) => Place::Leaf(log_odds),
            Entry::Unknown => Place::Unknown,
        }
    }

    /// The log-odds of a cell whose place is known.
    #[inline]
    pub(crate) fn log_odds_at(&self, place: Place, key: Key) -> Option<f32> {
        match place {
            Place::Unknown => None,
            Place::Leaf(log_odds) => Some(log_odds),
            Place::Block(block) => {
                let block = &self.blocks[block as usize];
                let entry = entry_of(key, 0);
                super::has(&block.known, entry).then(|| block.log_odds[entry])
            }
        }
    }

    /// The colour of a cell; [`NO_COLOR`] without one.
    pub(crate) fn cell_color(&self, key: Key) -> Rgb {
        let Some(colors) = &self.colors else { return NO_COLOR };
        match self.color_slot(key) {
            Some((0, node, entry)) => colors.blocks[node][entry],
            Some((_, node, entry)) => colors.branches[node][entry],
            None => NO_COLOR,
        }
    }

    /// OctoMap's `averageNodeColor`: half the old colour, half the new one.
    pub(crate) fn blend_color(&mut self, key: Key, color: Rgb) {
        let slot = self.color_slot(key);
        let Some(colors) = &mut self.colors else { return };
        let old = match slot {
            Some((0, node, entry)) => &mut colors.blocks[node][entry],
            Some((_, node, entry)) => &mut colors.branches[node][entry],
            None => return,
        };
        let blended = if *old == NO_COLOR { color } else { half_and_half(*old, color) };
        // Pure white means "no colour" in the files: keep a hair's breadth away from it.
        *old = if blended == NO_COLOR { [255, 255, 254] } else { blended };
    }

    /// Level, node and entry of the leaf that covers a cell.
    fn color_slot(&self, key: Key) -> Option<(u8, usize, usize)> {
        let mut node = 0;
        for level in (1..=ROOT_LEVEL).rev() {
            let entry = entry_of(key, level);
            match self.branches[node].entry(entry) {
                Entry::Child(child) => node = child as usize,
                Entry::Leaf(_) => return Some((level, node, entry)),
                Entry::Unknown => return None,
            }
        }
        Some((0, node, entry_of(key, 0)))
    }

    pub(super) fn node_max(&self, node: u32, level: u8) -> f32 {
        if level == 0 { self.blocks[node as usize].max } else { self.branches[node as usize].max }
    }
}

/// Changing cells.
impl Tree {
    /// Gives each chosen cell of the block that begins at `corner` one observation. To be followed by
    /// [`Self::settle`] once all blocks are done.
    pub(crate) fn observe(&mut self, corner: Key, misses: &Bits, hits: &Bits, model: &OccupancyModel) {
        let missed = misses.iter().any(|&word| word != 0);
        let hit = hits.iter().any(|&word| word != 0);
        let unmoved = |log_odds: f32| {
            (!missed || model.updated(log_odds, model.miss) == log_odds)
                && (!hit || model.updated(log_odds, model.hit) == log_odds)
        };
        let Some(block) = self.block_to_change(corner, unmoved) else { return };
        let block = &mut self.blocks[block as usize];
        block.observe(misses, hits, model);
        block.refresh();
        self.touch(corner);
    }

    /// Changes one cell's log-odds; `None` forgets the cell. To be followed by [`Self::settle`].
    pub(crate) fn change_cell(&mut self, key: Key, change: impl FnOnce(Option<f32>) -> Option<f32>) {
        let old = self.log_odds_at(self.place(key), key);
        let new = change(old);
        if new == old {
            return;
        }
        let Some(block) = self.block_to_change(key, |_| false) else { return };
        let entry = entry_of(key, 0);
        let cells = &mut self.blocks[block as usize];
        cells.log_odds[entry] = new.unwrap_or(0.0);
        cells.known[entry / 64] &= !(1 << (entry % 64));
        cells.known[entry / 64] |= u64::from(new.is_some()) << (entry % 64);
        cells.refresh();
        if let (None, Some(colors)) = (new, &mut self.colors) {
            colors.blocks[block as usize][entry] = NO_COLOR;
        }
        self.touch(key);
    }

    /// The block around a cell, made if need be; `None` if it is part of a leaf that stays as it is.
    fn block_to_change(&mut self, key: Key, unmoved: impl Fn(f32) -> bool) -> Option<u32> {
        let mut node = 0;
        for level in (1..=ROOT_LEVEL).rev() {
            let entry = entry_of(key, level);
            node = match self.branches[node as usize].entry(entry) {
                Entry::Child(child) => child,
                Entry::Leaf(log_odds) if unmoved(log_odds) => return None,
                old => self.add_child(node, level, entry, old),
            };
        }
        Some(node)
    }

    /// Puts a node in the place of an entry that has none. What was a leaf is spread over the new node's
    /// entries.
    pub(super) fn add_child(&mut self, parent: u32, level: u8, entry: usize, old: Entry) -> u32 {
        let color = match (&self.colors, old) {
            (Some(colors), Entry::Leaf(_)) => colors.branches[parent as usize][entry],
            _ => NO_COLOR,
        };
        let child = if level == 1 {
            let block = if let Entry::Leaf(value) = old { Block::filled(value) } else { Block::EMPTY };
            let index = allot(&mut self.blocks, &mut self.free_blocks, block);
            if let Some(colors) = &mut self.colors {
                allot_color(&mut colors.blocks, index, color);
            }
            index
        } else {
            let branch = if let Entry::Leaf(value) = old { Branch::filled(value) } else { Branch::EMPTY };
            let index = allot(&mut self.branches, &mut self.free_branches, branch);
            if let Some(colors) = &mut self.colors {
                allot_color(&mut colors.branches, index, color);
            }
            index
        };
        self.branches[parent as usize].set(entry, Entry::Child(child));
        child
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
                self.settle_branch(*key, level);
                *key = key.map(|index| index >> 3);
            }
        }
        touched.clear();
        self.touched = touched;
    }

    /// Settles the branch of a level whose cells have keys that begin with `prefix`.
    fn settle_branch(&mut self, prefix: Key, level: u8) {
        // The root's prefix has no bits left.
        let key = if level == ROOT_LEVEL { [0; 3] } else { prefix.map(|index| index << (3 * level + 3)) };
        let mut node = 0;
        for above in (level + 1..=ROOT_LEVEL).rev() {
            match self.branches[node as usize].entry(entry_of(key, above)) {
                Entry::Child(child) => node = child,
                _ => return,
            }
        }
        self.settle_node(node, level);
    }

    /// Takes children that are empty or one single leaf into the branch, and brings its `max` up to date.
    pub(super) fn settle_node(&mut self, node: u32, level: u8) {
        let children = self.branches[node as usize].children;
        let mut max = f32::NEG_INFINITY;
        for_each_bit(&children, |entry| {
            let child = self.branches[node as usize].data[entry];
            if let Some(replacement) = self.replacement(child, level - 1) {
                self.replace_child(node, level, entry, child, replacement);
            } else {
                max = max.max(self.node_max(child, level - 1));
            }
        });
        let branch = &mut self.branches[node as usize];
        for_each_bit(&branch.leaves, |entry| max = max.max(f32::from_bits(branch.data[entry])));
        branch.max = max;
    }

    /// What a node can be replaced by: nothing at all, or one leaf.
    fn replacement(&self, node: u32, level: u8) -> Option<Entry> {
        if level == 0 {
            let block = &self.blocks[node as usize];
            if block.known == [0; 8] { Some(Entry::Unknown) } else { block.single_value().map(Entry::Leaf) }
        } else {
            let branch = &self.branches[node as usize];
            if branch.is_empty() { Some(Entry::Unknown) } else { branch.single_value().map(Entry::Leaf) }
        }
    }

    fn replace_child(&mut self, node: u32, level: u8, entry: usize, child: u32, replacement: Entry) {
        if let Some(colors) = &mut self.colors {
            let below = if level == 1 { &colors.blocks } else { &colors.branches };
            let color = mean_color(below[child as usize].iter().copied());
            colors.branches[node as usize][entry] = color;
        }
        self.free_node(child, level - 1);
        self.branches[node as usize].set(entry, replacement);
    }

    /// Lets a node of a level be used again.
    pub(super) fn free_node(&mut self, node: u32, level: u8) {
        if level == 0 { &mut self.free_blocks } else { &mut self.free_branches }.push(node);
    }

    /// Makes an octree node at `depth` that begins at `corner` one leaf, as a file says. Only where nothing
    /// is known yet; to be followed by [`Self::settle_all`].
    pub(crate) fn fill(&mut self, corner: Key, depth: u8, log_odds: f32, color: Rgb) {
        let (target, log8) = ((DEPTH - depth) / 3, (DEPTH - depth) % 3);
        let mut node = 0;
        for level in (target + 1..=ROOT_LEVEL).rev() {
            let entry = entry_of(corner, level);
            node = match self.branches[node as usize].entry(entry) {
                Entry::Child(child) => child,
                old => self.add_child(node, level, entry, old),
            };
        }
        let start = entry_of(corner, target);
        for entry in start..start + (1 << (3 * log8)) {
            if target == 0 {
                let block = &mut self.blocks[node as usize];
                block.known[entry / 64] |= 1 << (entry % 64);
                block.log_odds[entry] = log_odds;
            } else {
                self.branches[node as usize].set(entry, Entry::Leaf(log_odds));
            }
            if let Some(colors) = &mut self.colors {
                let nodes = if target == 0 { &mut colors.blocks } else { &mut colors.branches };
                nodes[node as usize][entry] = color;
            }
        }
    }

    /// Changes every value, and settles all nodes.
    pub(crate) fn map_values(&mut self, f: impl Fn(f32) -> f32) {
        for block in &mut self.blocks {
            for_each_bit(&block.known, |entry| block.log_odds[entry] = f(block.log_odds[entry]));
        }
        for branch in &mut self.branches {
            for_each_bit(&branch.leaves, |entry| {
                branch.data[entry] = f(f32::from_bits(branch.data[entry])).to_bits();
            });
        }
        self.settle_all();
    }

    /// Restores the two rules everywhere.
    pub(crate) fn settle_all(&mut self) {
        for block in &mut self.blocks {
            block.refresh();
        }
        self.settle_below(0, ROOT_LEVEL);
    }

    /// Children first; at most five levels deep.
    fn settle_below(&mut self, node: u32, level: u8) {
        if level > 1 {
            let children = self.branches[node as usize].children;
            for_each_bit(&children, |entry| {
                let child = self.branches[node as usize].data[entry];
                self.settle_below(child, level - 1);
            });
        }
        self.settle_node(node, level);
    }

    /// Adds another map's log-odds cell by cell, as independent evidence.
    pub(crate) fn merge(&mut self, other: &Self, model: &OccupancyModel) {
        self.merge_node(0, other, 0, ROOT_LEVEL, model);
        self.settle_all();
    }

    fn merge_node(&mut self, node: u32, other: &Self, other_node: u32, level: u8, model: &OccupancyModel) {
        if level == 0 {
            let theirs = &other.blocks[other_node as usize];
            let ours = &mut self.blocks[node as usize];
            for_each_bit(&theirs.known, |entry| {
                ours.log_odds[entry] = model.clamped(ours.log_odds[entry] + theirs.log_odds[entry]);
            });
            for (ours, theirs) in ours.known.iter_mut().zip(&theirs.known) {
                *ours |= theirs;
            }
            if let (Some(ours), Some(theirs)) = (&mut self.colors, &other.colors) {
                let theirs = &theirs.blocks[other_node as usize];
                for (ours, &theirs) in ours.blocks[node as usize].iter_mut().zip(theirs) {
                    *ours = blended(*ours, theirs);
                }
            }
        } else {
            for entry in 0..ENTRIES {
                match other.branches[other_node as usize].entry(entry) {
                    Entry::Unknown => {}
                    Entry::Leaf(log_odds) => {
                        self.add_to_entry(node, level, entry, log_odds, model);
                        if let Some(colors) = &other.colors {
                            self.blend_entry(node, level, entry, colors.branches[other_node as usize][entry]);
                        }
                    }
                    Entry::Child(theirs) => {
                        let ours = match self.branches[node as usize].entry(entry) {
                            Entry::Child(ours) => ours,
                            old => self.add_child(node, level, entry, old),
                        };
                        self.merge_node(ours, other, theirs, level - 1, model);
                    }
                }
            }
        }
    }

    /// Adds the same log-odds to all cells below an entry.
    fn add_to_entry(&mut self, node: u32, level: u8, entry: usize, update: f32, model: &OccupancyModel) {
        match self.branches[node as usize].entry(entry) {
            Entry::Unknown => {
                self.branches[node as usize].set(entry, Entry::Leaf(model.clamped(update)));
            }
            Entry::Leaf(value) => {
                self.branches[node as usize].set(entry, Entry::Leaf(model.clamped(value + update)));
            }
            Entry::Child(block) if level == 1 => {
                let block = &mut self.blocks[block as usize];
                for value in &mut block.log_odds {
                    *value = model.clamped(*value + update);
                }
                block.known = [u64::MAX; 8];
            }
            Entry::Child(child) => {
                for entry in 0..ENTRIES {
                    self.add_to_entry(child, level - 1, entry, update, model);
                }
            }
        }
    }

    /// Blends a colour with those of all leaves below an entry.
    fn blend_entry(&mut self, node: u32, level: u8, entry: usize, color: Rgb) {
        let below = self.branches[node as usize].entry(entry);
        let Some(colors) = &mut self.colors else { return };
        match below {
            Entry::Child(block) if level == 1 => {
                for ours in &mut colors.blocks[block as usize] {
                    *ours = blended(*ours, color);
                }
            }
            Entry::Child(child) => {
                for entry in 0..ENTRIES {
                    self.blend_entry(child, level - 1, entry, color);
                }
            }
            Entry::Leaf(_) | Entry::Unknown => {
                let ours = &mut colors.branches[node as usize][entry];
                *ours = blended(*ours, color);
            }
        }
    }
}

/// Two colours half and half, or the one there is.
fn blended(a: Rgb, b: Rgb) -> Rgb {
    match (a, b) {
        (NO_COLOR, only) | (only, NO_COLOR) => only,
        _ => half_and_half(a, b),
    }
}

fn half_and_half(a: Rgb, b: Rgb) -> Rgb {
    std::array::from_fn(|i| u16::midpoint(u16::from(a[i]), u16::from(b[i])) as u8)
}

/// Puts a node into an arena: into a freed place, if there is one.
fn allot<T>(arena: &mut Vec<T>, free: &mut Vec<u32>, node: T) -> u32 {
    if let Some(index) = free.pop() {
        arena[index as usize] = node;
        index
    } else {
        arena.push(node);
        arena.len() as u32 - 1
    }
}

fn allot_color(colors: &mut Vec<[Rgb; ENTRIES]>, index: u32, color: Rgb) {
    if index as usize == colors.len() {
        colors.push([color; ENTRIES]);
    } else {
        colors[index as usize] = [color; ENTRIES];
    }
}
