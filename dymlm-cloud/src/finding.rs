/// What a frame has found in a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Finding {
    Surface,
    LookedThrough,
    Mover,
}

/// Number of different findings.
pub(crate) const FINDINGS: usize = 3;

/// The counts of a cell, by [`Finding`].
pub(crate) type Counts = [u32; FINDINGS];
