/// What a floor plan says of a cell.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PlanCell {
    /// Something stands there.
    Occupied,
    /// Free floor.
    Free,
    /// Nobody has seen it.
    Unknown,
}

/// A floor plan as an occupancy grid, such as the maps that robots navigate by.
#[derive(Debug, Clone, PartialEq)]
pub struct PlanGrid {
    /// Number of cells along x.
    pub width: usize,
    /// Number of cells along y.
    pub height: usize,
    /// Side of a cell, metres.
    pub resolution: f64,
    /// The lower left corner of cell (0, 0), metres.
    pub origin: [f64; 2],
    /// All cells, row by row from the lowest y, x running fastest.
    pub cells: Vec<PlanCell>,
}

impl PlanGrid {
    /// The cell that holds a point of the floor, metres; unknown outside the plan and for NaN.
    pub fn at(&self, point: [f64; 2]) -> PlanCell {
        let [x, y] = [0, 1].map(|axis| ((point[axis] - self.origin[axis]) / self.resolution).floor());
        // NaN fails.
        if x >= 0.0 && x < self.width as f64 && y >= 0.0 && y < self.height as f64 {
            let index = y as usize * self.width + x as usize;
            self.cells.get(index).copied().unwrap_or(PlanCell::Unknown)
        } else {
            PlanCell::Unknown
        }
    }
}
