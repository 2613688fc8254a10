use std::sync::Arc;

use dymlm_core::Rgb;

use super::colors::EntryColors;
use super::{Bits, Block, ENTRIES, for_each_bit};

/// 8 x 8 x 8 entries, each of them unknown, a leaf, or a node of the level below.
#[derive(Debug, Clone)]
pub(crate) struct Branch {
    /// 1 to 5; branches of level 1 hold blocks.
    pub(super) level: u8,
    /// Entries that are leaves.
    pub(super) leaves: Bits,
    /// Entries that are nodes.
    pub(super) children: Bits,
    /// Largest log-odds below.
    pub(super) max: f32,
    /// Colours of the leaves.
    pub(super) colors: EntryColors,
    entries: [Entry; ENTRIES],
}

/// An entry of a branch. Clones of a tree share its nodes; a shared node is copied before it changes.
#[derive(Debug, Clone)]
pub(crate) enum Entry {
    Unknown,
    /// All cells have these log-odds.
    Leaf(f32),
    Block(Arc<Block>),
    Branch(Arc<Branch>),
}

impl Entry {
    /// What replaces an entry whose node is empty or all one leaf, and the colour of that leaf; `None` for
    /// any other entry.
    fn simpler(&self) -> Option<(Self, Rgb)> {
        let (is_empty, value, colors) = match self {
            Self::Unknown | Self::Leaf(_) => return None,
            Self::Block(block) => (block.known == [0; 8], block.single_value(), &block.colors),
            Self::Branch(branch) => (branch.is_empty(), branch.single_value(), &branch.colors),
        };
        let simpler = if is_empty { Some(Self::Unknown) } else { value.map(Self::Leaf) };
        simpler.map(|entry| (entry, colors.mean(0..ENTRIES)))
    }

    /// Largest log-odds in it.
    #[inline]
    pub(super) fn max(&self) -> f32 {
        match self {
            Self::Unknown => f32::NEG_INFINITY,
            Self::Leaf(log_odds) => *log_odds,
            Self::Block(block) => block.max,
            Self::Branch(branch) => branch.max,
        }
    }
}

impl Branch {
    pub(super) fn empty(level: u8) -> Self {
        Self {
            level,
            leaves: [0; 8],
            children: [0; 8],
            max: f32::NEG_INFINITY,
            colors: EntryColors::NONE,
            entries: [const { Entry::Unknown }; ENTRIES],
        }
    }

    /// A branch that is all one leaf.
    fn filled(level: u8, log_odds: f32, color: Rgb) -> Self {
        Self {
            level,
            leaves: [u64::MAX; 8],
            children: [0; 8],
            max: log_odds,
            colors: EntryColors::filled(color),
            entries: std::array::from_fn(|_| Entry::Leaf(log_odds)),
        }
    }

    #[inline]
    pub(super) fn entry(&self, entry: usize) -> &Entry {
        &self.entries[entry]
    }

    /// An entry, whose node may be changed but not replaced.
    pub(super) fn entry_mut(&mut self, entry: usize) -> &mut Entry {
        &mut self.entries[entry]
    }

    pub(super) fn set(&mut self, index: usize, entry: Entry) {
        let bit = 1 << (index % 64);
        self.leaves[index / 64] &= !bit;
        self.children[index / 64] &= !bit;
        match entry {
            Entry::Unknown => {}
            Entry::Leaf(_) => self.leaves[index / 64] |= bit,
            Entry::Block(_) | Entry::Branch(_) => self.children[index / 64] |= bit,
        }
        self.entries[index] = entry;
    }

    /// Makes an entry a node if it is none: a leaf is spread over the node's entries.
    pub(super) fn parted(&mut self, entry: usize) -> &mut Entry {
        let (below, color) = (self.level - 1, self.colors.at(entry));
        let node = match (&self.entries[entry], below) {
            (Entry::Block(_) | Entry::Branch(_), _) => None,
            (Entry::Leaf(value), 0) => Some(Entry::Block(Arc::new(Block::filled(*value, color)))),
            (Entry::Leaf(value), _) => Some(Entry::Branch(Arc::new(Self::filled(below, *value, color)))),
            (Entry::Unknown, 0) => Some(Entry::Block(Arc::new(Block::EMPTY))),
            (Entry::Unknown, _) => Some(Entry::Branch(Arc::new(Self::empty(below)))),
        };
        if let Some(node) = node {
            self.set(entry, node);
        }
        &mut self.entries[entry]
    }

    pub(super) fn is_empty(&self) -> bool {
        self.leaves == [0; 8] && self.children == [0; 8]
    }

    /// The one value of all entries, if all are leaves of that value.
    fn single_value(&self) -> Option<f32> {
        match self.entries[0] {
            Entry::Leaf(first) if self.leaves == [u64::MAX; 8] && self.is_all(0..ENTRIES, first) => {
                Some(first)
            }
            _ => None,
        }
    }

    /// Whether all of these entries are leaves with this value.
    pub(super) fn is_all(&self, entries: std::ops::Range<usize>, value: f32) -> bool {
        self.entries[entries].iter().all(|entry| matches!(entry, Entry::Leaf(own) if *own == value))
    }

    /// Of how many entries the leaf around an entry is made, as a power of 8: neighbouring entries that are
    /// equal leaves are one leaf of twice or four times their side. 0 for an entry that is no leaf.
    pub(super) fn leaf_log8(&self, entry: usize) -> u32 {
        let Entry::Leaf(value) = self.entries[entry] else { return 0 };
        let is_leaf = |log8: u32| {
            let first = entry >> (3 * log8) << (3 * log8);
            self.is_all(first..first + (1 << (3 * log8)), value)
        };
        (1..=2).take_while(|&log8| is_leaf(log8)).last().unwrap_or(0)
    }

    /// Replaces nodes that are empty or all one leaf by an unknown entry or a leaf, and brings `max` up to
    /// date.
    pub(super) fn settle(&mut self) {
        let mut max = f32::NEG_INFINITY;
        let children = self.children;
        for_each_bit(&children, |entry| {
            if let Some((simpler, color)) = self.entries[entry].simpler() {
                self.colors.set(entry, color);
                self.set(entry, simpler);
            } else {
                max = max.max(self.entries[entry].max());
            }
        });
        for_each_bit(&self.leaves, |entry| max = max.max(self.entries[entry].max()));
        self.max = max;
    }

    /// Settles all nodes below that may have changed, then the branch. At most five levels deep.
    pub(super) fn settle_all(&mut self) {
        let children = self.children;
        for_each_bit(&children, |entry| match &mut self.entries[entry] {
            // A node that a clone of the map shares has not changed since it was settled.
            Entry::Block(block) => {
                if let Some(block) = Arc::get_mut(block) {
                    block.refresh();
                }
            }
            Entry::Branch(branch) => {
                if let Some(branch) = Arc::get_mut(branch) {
                    branch.settle_all();
                }
            }
            Entry::Unknown | Entry::Leaf(_) => {}
        });
        self.settle();
    }

    /// Changes every value below. To be followed by [`Self::settle_all`]. At most five levels deep.
    pub(super) fn map_values(&mut self, f: &impl Fn(f32) -> f32) {
        for entry in &mut self.entries {
            match entry {
                Entry::Unknown => {}
                Entry::Leaf(value) => *value = f(*value),
                Entry::Branch(branch) => Arc::make_mut(branch).map_values(f),
                Entry::Block(block) => {
                    let block = Arc::make_mut(block);
                    block.cells.change(&block.known, f);
                }
            }
        }
    }

    /// Bytes of the colours and of all nodes below, but for nodes that another branch shares. At most five
    /// levels deep.
    pub(super) fn memory_bytes_beside(&self, other: Option<&Self>) -> usize {
        let mut bytes = self.colors.memory_bytes();
        for_each_bit(&self.children, |entry| {
            bytes += match (&self.entries[entry], other.map(|other| &other.entries[entry])) {
                (Entry::Unknown | Entry::Leaf(_), _) => 0,
                (Entry::Block(own), Some(Entry::Block(other))) if Arc::ptr_eq(own, other) => 0,
                (Entry::Block(own), _) => super::shared_bytes::<Block>() + own.memory_bytes(),
                (Entry::Branch(own), Some(Entry::Branch(other))) if Arc::ptr_eq(own, other) => 0,
                (Entry::Branch(own), other) => {
                    let other = if let Some(Entry::Branch(other)) = other { Some(&**other) } else { None };
                    super::shared_bytes::<Self>() + own.memory_bytes_beside(other)
                }
            };
        });
        bytes
    }
}
