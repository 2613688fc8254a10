/// What is known of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum CellState {
    /// Observed, and occupied with a probability of at least 0.5.
    Occupied,
    /// Observed, and occupied with a probability below 0.5.
    Free,
    /// Never observed, or outside the map.
    Unknown,
}
