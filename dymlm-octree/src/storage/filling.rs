use std::sync::Arc;

use dymlm_core::Rgb;

use super::{Block, Branch, Entry, Tree};

/// One node of the octree that [`Tree`] stands for, still unknown and to be filled from a file. It is
/// addressed as a [`Subtree`](super::Subtree) is.
pub(crate) struct SubtreeToFill<'a> {
    node: Node<'a>,
    start: usize,
    log8: u8,
}

enum Node<'a> {
    Block(&'a mut Block),
    Branch(&'a mut Branch),
}

impl Tree {
    /// The whole octree. To be followed by [`Self::settle_all`].
    pub(crate) fn subtree_to_fill(&mut self) -> SubtreeToFill<'_> {
        SubtreeToFill { node: Node::Branch(self.root_mut()), start: 0, log8: 1 }
    }
}

impl SubtreeToFill<'_> {
    /// The i-th child, i = x + 2 y + 4 z; `None` for a smallest cell.
    pub(crate) fn child(&mut self, i: u8) -> Option<SubtreeToFill<'_>> {
        let i = usize::from(i);
        match (&mut self.node, self.log8.checked_sub(1)) {
            (Node::Block(block), Some(log8)) => {
                Some(SubtreeToFill { node: Node::Block(block), start: self.start + (i << (3 * log8)), log8 })
            }
            (Node::Branch(branch), Some(log8)) => Some(SubtreeToFill {
                node: Node::Branch(branch),
                start: self.start + (i << (3 * log8)),
                log8,
            }),
            (Node::Branch(branch), None) => {
                let node = match branch.parted(self.start) {
                    Entry::Block(block) => Node::Block(Arc::make_mut(block)),
                    Entry::Branch(below) => Node::Branch(Arc::make_mut(below)),
                    Entry::Unknown | Entry::Leaf(_) => return None,
                };
                Some(SubtreeToFill { node, start: i << 6, log8: 2 })
            }
            (Node::Block(_), None) => None,
        }
    }

    /// Makes the node one leaf.
    pub(crate) fn fill(self, log_odds: f32, color: Rgb) {
        let entries = self.start..self.start + (1 << (3 * self.log8));
        match self.node {
            Node::Block(block) => entries.for_each(|entry| {
                block.set(entry, Some(log_odds));
                block.colors.set(entry, color);
            }),
            Node::Branch(branch) => entries.for_each(|entry| {
                branch.set(entry, Entry::Leaf(log_odds));
                branch.colors.set(entry, color);
            }),
        }
    }
}
