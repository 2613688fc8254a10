use super::FaceCells;

impl FaceCells {
    /// For each cell, the number of the visible piece that it belongs to; `None` for cells not seen. Pieces are
    /// numbered by their first cells. Seen cells belong together, directly or through others, when the unseen
    /// strip between them is narrower than `gap` metres.
    ///
    /// O(cells x cells within the gap).
    pub(crate) fn visible_pieces(&self, gap: f64) -> Vec<Option<usize>> {
        let (columns, rows) = (self.raster.columns(), self.raster.rows());
        let [across, up] = self.raster.cell().map(|cell| (gap / cell).round().max(1.0) as usize);
        let mut pieces = vec![None; self.seen.len()];
        let mut count = 0;
        let mut open = Vec::new();
        for first in 0..self.seen.len() {
            if !self.seen[first] || pieces[first].is_some() {
                continue;
            }
            pieces[first] = Some(count);
            open.push(first);
            while let Some(cell) = open.pop() {
                let (row, column) = (cell / columns, cell % columns);
                for row in row.saturating_sub(up)..rows.min(row + up + 1) {
                    for column in column.saturating_sub(across)..columns.min(column + across + 1) {
                        let near = row * columns + column;
                        if self.seen[near] && pieces[near].is_none() {
                            pieces[near] = Some(count);
                            open.push(near);
                        }
                    }
                }
            }
            count += 1;
        }
        pieces
    }
}

#[cfg(test)]
mod tests {
    use crate::true_face::CellRaster;

    use super::*;

    /// Pieces of cells of 2 cm, `#` where they are seen.
    fn pieces(row: &str, gap: f64) -> Vec<Option<usize>> {
        let corners = [[0.0, 0.0, 0.0], [0.02 * row.len() as f64, 0.02, 0.0]];
        let raster = CellRaster::around(corners.into_iter(), [0.0, 0.0, 1.0], [1.0, 0.0, 0.0], 0.02).unwrap();
        let seen: Vec<bool> = row.bytes().map(|byte| byte == b'#').collect();
        FaceCells { raster, inside: vec![true; seen.len()], read: seen.clone(), seen }.visible_pieces(gap)
    }

    #[test]
    fn a_strip_as_wide_as_the_gap_parts_pieces() {
        assert_eq!(pieces("#..#", 0.06), [Some(0), None, None, Some(0)]);
        assert_eq!(pieces("#...#", 0.06), [Some(0), None, None, None, Some(1)]);
        assert_eq!(pieces("....", 0.06), [None; 4]);
        // Through others.
        assert_eq!(pieces("#.#.#", 0.04), [Some(0), None, Some(0), None, Some(0)]);
    }
}
