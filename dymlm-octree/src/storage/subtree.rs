use dymlm_core::Rgb;

use super::branch::Entry;
use super::{NO_COLOR, ROOT_LEVEL, Tree, has, mean_color};
use crate::lattice::{DEPTH, Key};

/// One node of the octree that [`Tree`] stands for: `8^log8` neighbouring entries of one stored node.
///
/// A subtree of one entry that holds a child is always written as that child with all its entries.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Subtree {
    /// Index of the stored node: of a block at level 0, of a branch above.
    node: u32,
    level: u8,
    start: u16,
    log8: u8,
}

/// What an octree node is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Kind {
    /// Nothing below has been observed.
    Absent,
    /// All cells below have these log-odds.
    Leaf(f32),
    /// It has children.
    Inner,
}

impl Subtree {
    pub(crate) const ROOT: Self = Self { node: 0, level: ROOT_LEVEL, start: 0, log8: 1 };

    /// Octree depth, 0 to 16.
    #[inline]
    pub(crate) fn depth(self) -> u8 {
        DEPTH - 3 * self.level - self.log8
    }

    #[inline]
    fn entries(self) -> std::ops::Range<usize> {
        let start = usize::from(self.start);
        start..start + (1 << (3 * self.log8))
    }
}

/// Lower corner of the i-th child of an octree node at `depth` that begins at `corner`.
#[inline]
pub(crate) fn child_corner(corner: Key, depth: u8, i: u8) -> Key {
    let half = 1 << (DEPTH - 1 - depth);
    [
        corner[0] + u16::from(i & 1) * half,
        corner[1] + u16::from(i >> 1 & 1) * half,
        corner[2] + u16::from(i >> 2) * half,
    ]
}

impl Tree {
    pub(crate) fn kind(&self, subtree: Subtree) -> Kind {
        let entries = subtree.entries();
        let first = entries.start;
        if subtree.level == 0 {
            let block = &self.blocks[subtree.node as usize];
            match coverage(&block.known, subtree) {
                Coverage::None => Kind::Absent,
                Coverage::All if block.log_odds[entries].iter().all(|&v| v == block.log_odds[first]) => {
                    Kind::Leaf(block.log_odds[first])
                }
                _ => Kind::Inner,
            }
        } else {
            let branch = &self.branches[subtree.node as usize];
            match (coverage(&branch.children, subtree), coverage(&branch.leaves, subtree)) {
                (Coverage::None, Coverage::None) => Kind::Absent,
                (Coverage::None, Coverage::All)
                    if entries.clone().all(|i| branch.leaf(i) == branch.leaf(first)) =>
                {
                    Kind::Leaf(branch.leaf(first))
                }
                _ => Kind::Inner,
            }
        }
    }

    /// The i-th child of an inner node, i = x + 2 y + 4 z.
    #[inline]
    pub(crate) fn child(&self, subtree: Subtree, i: u8) -> Subtree {
        let log8 = subtree.log8 - 1;
        let start = subtree.start + (u16::from(i) << (3 * log8));
        if log8 == 0 && subtree.level > 0 {
            let branch = &self.branches[subtree.node as usize];
            if has(&branch.children, usize::from(start)) {
                let node = branch.data[usize::from(start)];
                return Subtree { node, level: subtree.level - 1, start: 0, log8: 3 };
            }
        }
        Subtree { node: subtree.node, level: subtree.level, start, log8 }
    }

    /// The octree node at a depth that covers a cell, or the leaf above it.
    pub(crate) fn subtree_at(&self, key: Key, depth: u8) -> Subtree {
        let (target, log8) = ((DEPTH - depth) / 3, (DEPTH - depth) % 3);
        let mut node = 0;
        let mut level = ROOT_LEVEL;
        loop {
            let entry = super::entry_of(key, level);
            let start = (entry >> (3 * log8) << (3 * log8)) as u16;
            if level == target {
                let found = Subtree { node, level, start, log8 };
                // A single entry that holds a child is written as the child.
                return match (log8, level) {
                    (0, 1..) => match self.branches[node as usize].entry(entry) {
                        Entry::Child(node) => Subtree { node, level: level - 1, start: 0, log8: 3 },
                        _ => found,
                    },
                    _ => found,
                };
            }
            match self.branches[node as usize].entry(entry) {
                Entry::Child(child) => (node, level) = (child, level - 1),
                _ => return Subtree { node, level, start: entry as u16, log8: 0 },
            }
        }
    }

    /// OctoMap's value of an octree node: the largest log-odds below; `None` when nothing is known there.
    pub(crate) fn max_log_odds(&self, subtree: Subtree) -> Option<f32> {
        let entries = subtree.entries();
        let mut max = f32::NEG_INFINITY;
        if subtree.level == 0 {
            let block = &self.blocks[subtree.node as usize];
            if subtree.log8 == 3 {
                return Some(block.max);
            }
            for entry in entries.filter(|&entry| has(&block.known, entry)) {
                max = max.max(block.log_odds[entry]);
            }
        } else {
            let branch = &self.branches[subtree.node as usize];
            if subtree.log8 == 3 {
                return Some(branch.max);
            }
            for entry in entries {
                max = max.max(match branch.entry(entry) {
                    Entry::Unknown => f32::NEG_INFINITY,
                    Entry::Leaf(log_odds) => log_odds,
                    Entry::Child(child) => self.node_max(child, subtree.level - 1),
                });
            }
        }
        (max > f32::NEG_INFINITY).then_some(max)
    }

    /// The mean colour of all that has one below an octree node; [`NO_COLOR`] without colours.
    pub(crate) fn color(&self, subtree: Subtree) -> Rgb {
        let Some(colors) = &self.colors else { return NO_COLOR };
        let entries = subtree.entries();
        if subtree.level == 0 {
            return mean_color(colors.blocks[subtree.node as usize][entries].iter().copied());
        }
        let branch = &self.branches[subtree.node as usize];
        mean_color(entries.map(|entry| match branch.entry(entry) {
            Entry::Unknown => NO_COLOR,
            Entry::Leaf(_) => colors.branches[subtree.node as usize][entry],
            Entry::Child(node) => self.color(Subtree { node, level: subtree.level - 1, start: 0, log8: 3 }),
        }))
    }
}

enum Coverage {
    None,
    Some,
    All,
}

/// How many of a subtree's entries have their bit set.
#[inline]
fn coverage(bits: &super::Bits, subtree: Subtree) -> Coverage {
    let start = usize::from(subtree.start);
    let (bits, all) = match subtree.log8 {
        0 => (bits[start / 64] >> (start % 64) & 1, 1),
        1 => (bits[start / 64] >> (start % 64) & 0xFF, 0xFF),
        2 => (bits[start / 64], u64::MAX),
        _ if bits.iter().all(|&word| word == u64::MAX) => return Coverage::All,
        _ if bits.iter().all(|&word| word == 0) => return Coverage::None,
        _ => return Coverage::Some,
    };
    match bits {
        0 => Coverage::None,
        bits if bits == all => Coverage::All,
        _ => Coverage::Some,
    }
}
