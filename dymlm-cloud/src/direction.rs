/// Whether a frame is put in or taken out.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Direction {
    Insert,
    Remove,
}

impl Direction {
    /// +1 or -1 for wrapping counters.
    #[inline]
    pub(crate) fn unit(self) -> u32 {
        match self {
            Self::Insert => 1,
            Self::Remove => 1_u32.wrapping_neg(),
        }
    }
}
