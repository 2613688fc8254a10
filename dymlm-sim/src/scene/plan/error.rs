use dymlm_core::ConfigError;

/// Why no building can be made from a floor plan.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum PlanError {
    /// A resolution, an origin, an area or a height of walls outside its range.
    #[error("the floor plan's {0}")]
    Config(#[from] ConfigError),
    /// Cells whose number is not width times height.
    #[error("{cells} cells for a floor plan of {width}x{height}")]
    CellCount {
        /// Given number of cells.
        cells: usize,
        /// Cells along x.
        width: usize,
        /// Cells along y.
        height: usize,
    },
    /// A plan with more than [`BuildingPlan::MAX_CELLS`](crate::BuildingPlan::MAX_CELLS) cells, or none.
    #[error("a floor plan of {width}x{height} cells: there must be 1 to 2^24 of them")]
    Size {
        /// Cells along x.
        width: usize,
        /// Cells along y.
        height: usize,
    },
    /// No cell is free.
    #[error("the floor plan has no free cell")]
    NothingFree,
    /// No cell is occupied, but for specks of one or two cells.
    #[error("the floor plan has no walls: nothing larger than 2x2 cells is occupied")]
    NoWalls,
    /// Nowhere is there enough free floor to carry a camera.
    #[error("nowhere on the floor plan are {0} m of free floor in each direction, which a camera needs")]
    NoWay(f32),
}
