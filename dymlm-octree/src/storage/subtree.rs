use std::ops::Range;

use dymlm_core::Rgb;

use super::{Bits, Block, Branch, ENTRIES, Entry, NO_COLOR, ROOT_LEVEL, Tree, entry_of, mean_color};
use crate::lattice::{DEPTH, Key};

/// One node of the octree that [`Tree`] stands for: `8^log8` neighbouring entries of one stored node.
///
/// A subtree of one entry that holds a node is always given as that node with all its entries.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Subtree<'a> {
    node: Node<'a>,
    level: u8,
    start: u16,
    log8: u8,
}

#[derive(Debug, Clone, Copy)]
enum Node<'a> {
    Block(&'a Block),
    Branch(&'a Branch),
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
    /// The whole octree.
    pub(crate) fn subtree(&self) -> Subtree<'_> {
        Subtree { node: Node::Branch(self.root()), level: ROOT_LEVEL, start: 0, log8: 1 }
    }

    /// The octree node at a depth that covers a cell, or the leaf above it.
    pub(crate) fn subtree_at(&self, key: Key, depth: u8) -> Subtree<'_> {
        let (target, log8) = ((DEPTH - depth) / 3, (DEPTH - depth) % 3);
        let aligned = |entry: usize| (entry >> (3 * log8) << (3 * log8)) as u16;
        let mut branch = self.root();
        loop {
            let entry = entry_of(key, branch.level);
            if branch.level == target {
                if log8 == 0 {
                    return Subtree::of_entry(branch, entry);
                }
                let (node, start) = (Node::Branch(branch), aligned(entry));
                return Subtree { node, level: branch.level, start, log8 };
            }
            match branch.entry(entry) {
                Entry::Branch(below) => branch = below,
                Entry::Block(block) => {
                    let start = aligned(entry_of(key, 0));
                    return Subtree { node: Node::Block(block), level: 0, start, log8 };
                }
                Entry::Leaf(_) | Entry::Unknown => return Subtree::of_entry(branch, entry),
            }
        }
    }
}

impl<'a> Subtree<'a> {
    /// `log8` of a whole node.
    const WHOLE: u8 = 3;

    /// One entry of a branch.
    #[inline]
    fn of_entry(branch: &'a Branch, entry: usize) -> Self {
        match branch.entry(entry) {
            Entry::Block(block) => Self { node: Node::Block(block), level: 0, start: 0, log8: Self::WHOLE },
            Entry::Branch(below) => {
                Self { node: Node::Branch(below), level: below.level, start: 0, log8: Self::WHOLE }
            }
            Entry::Leaf(_) | Entry::Unknown => {
                Self { node: Node::Branch(branch), level: branch.level, start: entry as u16, log8: 0 }
            }
        }
    }

    /// Octree depth, 0 to 16.
    #[inline]
    pub(crate) fn depth(self) -> u8 {
        DEPTH - 3 * self.level - self.log8
    }

    #[inline]
    fn entries(self) -> Range<usize> {
        let start = usize::from(self.start);
        start..start + (1 << (3 * self.log8))
    }

    pub(crate) fn kind(self) -> Kind {
        let entries = self.entries();
        match self.node {
            Node::Block(block) if self.log8 == 0 => {
                block.cell(entries.start).map_or(Kind::Absent, Kind::Leaf)
            }
            Node::Block(block) => match self.coverage(&block.known) {
                Coverage::None => Kind::Absent,
                Coverage::All => {
                    leaf_or_inner(block.cells.get(entries.start), |_| block.cells.all_same(entries))
                }
                Coverage::Some => Kind::Inner,
            },
            Node::Branch(branch) => match (self.coverage(&branch.children), self.coverage(&branch.leaves)) {
                (Coverage::None, Coverage::None) => Kind::Absent,
                (Coverage::None, Coverage::All) => {
                    leaf_or_inner(branch.entry(entries.start).max(), |first| branch.is_all(entries, first))
                }
                _ => Kind::Inner,
            },
        }
    }

    /// The i-th child of an inner node, i = x + 2 y + 4 z.
    #[inline]
    pub(crate) fn child(self, i: u8) -> Self {
        let log8 = self.log8 - 1;
        let start = self.start + (u16::from(i) << (3 * log8));
        match self.node {
            Node::Branch(branch) if log8 == 0 => Self::of_entry(branch, usize::from(start)),
            node => Self { node, start, log8, ..self },
        }
    }

    /// OctoMap's value of an octree node: the largest log-odds below; `None` when nothing is known there.
    pub(crate) fn max_log_odds(self) -> Option<f32> {
        let is_whole = self.log8 == Self::WHOLE;
        let max = match self.node {
            Node::Block(block) if is_whole => block.max,
            Node::Branch(branch) if is_whole => branch.max,
            Node::Block(block) => {
                let known = self.entries().filter_map(|entry| block.cell(entry));
                known.fold(f32::NEG_INFINITY, f32::max)
            }
            Node::Branch(branch) => {
                self.entries().fold(f32::NEG_INFINITY, |max, entry| max.max(branch.entry(entry).max()))
            }
        };
        (max > f32::NEG_INFINITY).then_some(max)
    }

    /// The mean of the colours below an octree node; [`NO_COLOR`] without colours.
    pub(crate) fn color(self) -> Rgb {
        match self.node {
            Node::Block(block) => block.colors.mean(self.entries()),
            Node::Branch(branch) => mean_color(self.entries().map(|entry| match branch.entry(entry) {
                Entry::Unknown => NO_COLOR,
                Entry::Leaf(_) => branch.colors.at(entry),
                Entry::Block(block) => block.colors.mean(0..ENTRIES),
                Entry::Branch(_) => Self::of_entry(branch, entry).color(),
            })),
        }
    }

    /// Whether none, some or all of the entries have their bit set.
    #[inline]
    fn coverage(self, bits: &Bits) -> Coverage {
        let start = usize::from(self.start);
        let (bits, all) = match self.log8 {
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
}

fn leaf_or_inner(first: f32, is_all: impl FnOnce(f32) -> bool) -> Kind {
    if is_all(first) { Kind::Leaf(first) } else { Kind::Inner }
}

enum Coverage {
    None,
    Some,
    All,
}
