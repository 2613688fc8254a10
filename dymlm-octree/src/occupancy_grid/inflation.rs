use super::OccupancyGrid;
use crate::distance_field::Transform;
use crate::{CellState, Error};

impl OccupancyGrid {
    /// The same grid with an occupied margin: a cell whose centre is no farther than `radius` metres from the
    /// centre of an occupied cell becomes occupied too, whether it was free or unknown. Exact, by a Euclidean
    /// distance transform; the grid does not grow, and obstacles outside of it have no margin in it
    /// ([`cropped`](Self::cropped)). O(cells).
    ///
    /// A robot of that radius can go where its centre is on free cells.
    ///
    /// The inflated grid cannot be updated ([`Error::Inflated`]), as a new projection knows no margin: keep the
    /// grid itself, [`update`](Self::update) that, and inflate it again.
    ///
    /// # Errors
    ///
    /// [`Error::Inflation`] when the radius is negative or not finite.
    ///
    /// ```
    /// use dymlm_octree::{CellState, Octree, OctreeConfig};
    ///
    /// let mut map = Octree::new(OctreeConfig::default())?;
    /// map.insert_scan([0.0, 0.0, 1.01], &[[2.0, 0.01, 1.01]])?;
    /// let grid = map.project([0.0, 0.0, 1.0], 0.1, 1.8)?.inflated(0.2)?;
    /// let row: Vec<_> = (34..41).map(|x| grid.at(x, 0)).collect();
    /// assert_eq!(row, [vec![CellState::Free; 2], vec![CellState::Occupied; 5]].concat());
    /// # Ok::<(), dymlm_octree::Error>(())
    /// ```
    pub fn inflated(&self, radius: f64) -> Result<Self, Error> {
        if !(radius.is_finite() && radius >= 0.0) {
            return Err(Error::Inflation { radius });
        }
        let mut inflated = self.clone();
        inflated.is_inflated |= radius > 0.0;
        if self.cells.is_empty() {
            return Ok(inflated);
        }
        let mut squared = Vec::new();
        let is_occupied = self.cells.iter().map(|&cell| cell == CellState::Occupied);
        Transform::default().measure_layer(is_occupied, [self.width(), self.height()], &mut squared);
        // In cells; slightly enlarged, so that a radius of n cells includes the n-th cell.
        let reach = radius / self.resolution * (1.0 + 1e-9);
        for (cell, &squared) in inflated.cells.iter_mut().zip(&squared) {
            // Infinite where nothing is occupied.
            if squared.is_finite() && f64::from(squared) <= reach * reach {
                *cell = CellState::Occupied;
            }
        }
        Ok(inflated)
    }
}
