/// What is known of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum CellState {
    /// Observed, and more likely occupied than not.
    Occupied,
    /// Observed, and more likely free.
    Free,
    /// Never observed, or outside the map.
    Unknown,
}
