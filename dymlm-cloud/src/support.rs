/// How many frames speak for and against a place.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct Support {
    /// Frames that read a surface there.
    pub support: u32,
    /// Frames that looked through it.
    pub looked_through: u32,
    /// Frames that read a mover there.
    pub movers: u32,
}

impl Support {
    pub(crate) fn of([support, looked_through, movers]: [u32; 3]) -> Self {
        Self { support, looked_through, movers }
    }
}
