use std::iter::FusedIterator;
use std::ops::Range;

use super::{Sequence, SimulatedFrame};

/// The frames of a [`Sequence`] in order; each is rendered when it is asked for.
///
/// Frames that [`step_by`](Iterator::step_by), [`skip`](Iterator::skip) or [`nth`](Iterator::nth) leave out
/// are not rendered, so that every tenth frame costs a tenth.
#[derive(Debug, Clone)]
pub struct Frames<'a> {
    pub(super) sequence: &'a Sequence,
    pub(super) left: Range<usize>,
}

impl Iterator for Frames<'_> {
    type Item = SimulatedFrame;

    fn next(&mut self) -> Option<SimulatedFrame> {
        self.nth(0)
    }

    fn nth(&mut self, skipped: usize) -> Option<SimulatedFrame> {
        self.left.nth(skipped).and_then(|index| self.sequence.frame(index))
    }

    fn size_hint(&self) -> (usize, Option<usize>) {
        self.left.size_hint()
    }
}

impl ExactSizeIterator for Frames<'_> {}
impl FusedIterator for Frames<'_> {}
