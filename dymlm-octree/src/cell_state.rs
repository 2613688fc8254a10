/// What is known of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum CellState {
    /// Observed, and more likely occupied than not.
    Occupied,
    /// Observed, and more likely free.
    Free,
    /// Never observed, or outside the map.
    Unknown,
}
