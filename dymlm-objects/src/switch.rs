/// Whether a part of an algorithm is used: for those who want to see what it is good for.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum Switch {
    /// It is used.
    #[default]
    On,
    /// It is left out.
    Off,
}

impl Switch {
    #[inline]
    pub(crate) fn is_on(self) -> bool {
        self == Self::On
    }
}
