use super::{Bits, ENTRIES, has};

/// 8 x 8 x 8 entries, each of them unknown, a leaf, or a child node.
#[derive(Debug, Clone)]
pub(crate) struct Branch {
    /// Entries that are leaves.
    pub(crate) leaves: Bits,
    /// Entries that are child nodes.
    pub(crate) children: Bits,
    /// Largest log-odds below.
    pub(crate) max: f32,
    /// The bits of a leaf's log-odds, or the index of a child in its arena.
    pub(crate) data: [u32; ENTRIES],
}

/// An entry of a branch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Entry {
    Unknown,
    Leaf(f32),
    Child(u32),
}

impl Branch {
    pub(crate) const EMPTY: Self =
        Self { leaves: [0; 8], children: [0; 8], max: f32::NEG_INFINITY, data: [0; ENTRIES] };

    /// A branch that is all one leaf.
    pub(crate) fn filled(log_odds: f32) -> Self {
        Self { leaves: [u64::MAX; 8], children: [0; 8], max: log_odds, data: [log_odds.to_bits(); ENTRIES] }
    }

    #[inline]
    pub(crate) fn entry(&self, entry: usize) -> Entry {
        if has(&self.children, entry) {
            Entry::Child(self.data[entry])
        } else if has(&self.leaves, entry) {
            Entry::Leaf(self.leaf(entry))
        } else {
            Entry::Unknown
        }
    }

    /// The log-odds of an entry that is a leaf.
    #[inline]
    pub(crate) fn leaf(&self, entry: usize) -> f32 {
        f32::from_bits(self.data[entry])
    }

    pub(crate) fn set(&mut self, index: usize, entry: Entry) {
        let bit = 1 << (index % 64);
        self.leaves[index / 64] &= !bit;
        self.children[index / 64] &= !bit;
        match entry {
            Entry::Unknown => self.data[index] = 0,
            Entry::Leaf(log_odds) => {
                self.leaves[index / 64] |= bit;
                self.data[index] = log_odds.to_bits();
            }
            Entry::Child(child) => {
                self.children[index / 64] |= bit;
                self.data[index] = child;
            }
        }
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.leaves == [0; 8] && self.children == [0; 8]
    }

    /// The one value of all entries, if all are leaves of that value.
    pub(crate) fn single_value(&self) -> Option<f32> {
        let first = self.leaf(0);
        (self.leaves == [u64::MAX; 8] && self.data.iter().all(|&bits| f32::from_bits(bits) == first))
            .then_some(first)
    }
}
