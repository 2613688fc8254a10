use dymlm::core::BoundingBox;

use crate::Error;

/// Side of a cell in YOLOX's three grids, network pixels.
const STRIDES: [usize; 3] = [8, 16, 32];
/// Columns of a row before the classes: centre and size of the box, and the objectness.
const BEFORE_CLASSES: usize = 5;

/// A detection in a row of the output: class, score and box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Candidate {
    pub(crate) class: usize,
    pub(crate) score: f32,
    /// In the network's pixels.
    pub(crate) bounding_box: BoundingBox,
}

/// The rows of a network's output, one for each cell of each grid: the grids in the order of their strides,
/// the cells row by row.
///
/// A row is x, y, w, h, the objectness, and a probability for each class. The box's centre is (x, y) cells
/// from its own cell's corner, its size e^w times e^h cells (Ge et al. 2021, section 2.1).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct OutputGrid {
    network: [usize; 2],
    classes: usize,
}

impl OutputGrid {
    /// For a network with an input of `network` (width, height) pixels and an output of `rows` times
    /// `columns`; else a description of what is wrong with the output.
    pub(crate) fn new(network: [usize; 2], [rows, columns]: [usize; 2]) -> Result<Self, String> {
        let [width, height] = network;
        let largest = STRIDES.into_iter().max().unwrap_or(1);
        if network.iter().any(|side| *side == 0 || side % largest != 0) {
            return Err(format!("an input of {width}x{height} pixels, no multiples of {largest}"));
        }
        let cells: usize = STRIDES.iter().map(|stride| (width / stride) * (height / stride)).sum();
        if rows != cells || columns <= BEFORE_CLASSES {
            return Err(format!(
                "an output of {rows} rows of {columns} for an input of {width}x{height} pixels; \
                 YOLOX has {cells} rows of 5 and the number of classes"
            ));
        }
        Ok(Self { network, classes: columns - BEFORE_CLASSES })
    }

    /// Number of classes.
    pub(crate) fn classes(&self) -> usize {
        self.classes
    }

    /// The rows whose best class scores at least `min_score`, in order.
    ///
    /// # Errors
    ///
    /// [`Error::Output`] when a score is not a probability, or the box of a returned row is not finite.
    pub(crate) fn candidates(&self, output: &[f32], min_score: f32) -> Result<Vec<Candidate>, Error> {
        let mut found = Vec::new();
        let rows = output.chunks_exact(BEFORE_CLASSES + self.classes);
        for (row, (values, (corner, stride))) in rows.zip(self.cells()).enumerate() {
            let &[x, y, w, h, anything, ref classes @ ..] = values else { continue };
            let (class, best) = best_of(classes);
            let score = anything * best;
            let [u, v] = [(x + corner[0]) * stride, (y + corner[1]) * stride];
            let [half_width, half_height] = [w, h].map(|side| 0.5 * side.exp() * stride);
            let sides = [u - half_width, v - half_height, u + half_width, v + half_height];
            if (0.0..min_score).contains(&score) {
                continue;
            }
            match BoundingBox::try_from(sides) {
                Ok(bounding_box) if (0.0..=1.0).contains(&score) => {
                    found.push(Candidate { class, score, bounding_box });
                }
                _ => return Err(Error::Output { row, score, sides }),
            }
        }
        Ok(found)
    }

    /// Column and row of each cell, and the stride of its grid.
    fn cells(&self) -> impl Iterator<Item = ([f32; 2], f32)> + use<> {
        let [width, height] = self.network;
        STRIDES.into_iter().flat_map(move |stride| {
            let corners = (0..height / stride).flat_map(move |v| (0..width / stride).map(move |u| [u, v]));
            corners.map(move |corner| (corner.map(|cell| cell as f32), stride as f32))
        })
    }
}

/// The class with the highest probability, the first one if several are equal; a NaN counts as the highest,
/// so that it is noticed.
fn best_of(classes: &[f32]) -> (usize, f32) {
    let mut best = (0, f32::NEG_INFINITY);
    for (class, &probability) in classes.iter().enumerate() {
        if probability > best.1 || probability.is_nan() {
            best = (class, probability);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    const CLASSES: usize = 3;
    const COLUMNS: usize = 5 + CLASSES;
    /// 64x32 pixels: 8x4, 4x2 and 2x1 cells.
    const ROWS: usize = 32 + 8 + 2;

    fn grid() -> OutputGrid {
        OutputGrid::new([64, 32], [ROWS, COLUMNS]).unwrap()
    }

    fn output_with(row: usize, values: [f32; COLUMNS]) -> Vec<f32> {
        let mut output = vec![0.0; ROWS * COLUMNS];
        output[row * COLUMNS..][..COLUMNS].copy_from_slice(&values);
        output
    }

    /// Cells by hand: the last of the first grid, the second of the second, the last of the third.
    #[test]
    fn boxes_lie_where_their_cells_are() {
        let ln2 = 2.0_f32.ln();
        for (row, sides) in [
            (31, [56.0, 20.0, 64.0, 36.0]),
            (33, [16.0, -8.0, 32.0, 24.0]),
            (ROWS - 1, [32.0, -16.0, 64.0, 48.0]),
        ] {
            let output = output_with(row, [0.5, 0.5, 0.0, ln2, 0.9, 0.1, 0.5, 0.2]);
            let found = grid().candidates(&output, 0.25).unwrap();
            assert_eq!(found.len(), 1, "row {row}");
            assert_eq!((found[0].class, found[0].score), (1, 0.9 * 0.5));
            for (side, known) in <[f32; 4]>::from(found[0].bounding_box).into_iter().zip(sides) {
                assert!((side - known).abs() < 1e-4, "row {row}: {:?}", found[0]);
            }
        }
    }

    #[test]
    fn each_cell_is_there_once_and_in_order() {
        let cells: Vec<_> = grid().cells().collect();
        assert_eq!(cells.len(), ROWS);
        let index = |([u, v], stride): ([f32; 2], f32)| match stride as usize {
            8 => v as usize * 8 + u as usize,
            16 => 32 + v as usize * 4 + u as usize,
            _ => 40 + v as usize * 2 + u as usize,
        };
        assert!(cells.into_iter().map(index).eq(0..ROWS));
    }

    #[test]
    fn of_equal_classes_it_is_the_first_and_weak_rows_are_left_out() {
        let output = output_with(7, [0.0, 0.0, 0.0, 0.0, 1.0, 0.1, 0.4, 0.4]);
        assert_eq!(grid().candidates(&output, 0.4).unwrap()[0].class, 1);
        assert!(grid().candidates(&output, 0.41).unwrap().is_empty());
        assert_eq!(grid().candidates(&output, 0.0).unwrap().len(), ROWS);
    }

    #[test]
    fn scores_that_are_no_probabilities_and_boxes_without_end_are_refused() {
        let scores = [(3.0, 0.9), (f32::NAN, 0.9), (0.9, f32::NAN), (-0.5, 0.9)].map(|pair| (0.0, pair));
        for (w, (anything, probability)) in
            scores.into_iter().chain([(1e3, (1.0, 1.0)), (f32::NAN, (1.0, 1.0))])
        {
            let output = output_with(9, [0.0, 0.0, w, 0.0, anything, 0.0, probability, 0.0]);
            let error = grid().candidates(&output, 0.25).unwrap_err();
            assert!(
                error.to_string().starts_with("row 9 of the network's output is not a detection"),
                "{error}"
            );
        }
    }

    #[test]
    fn outputs_of_other_networks_are_refused() {
        assert_eq!(OutputGrid::new([416, 416], [3549, 85]).unwrap().classes(), 80);
        // YOLOv5 and YOLOv8 of 640x640.
        assert!(OutputGrid::new([640, 640], [25_200, 85]).unwrap_err().contains("8400 rows"));
        assert!(OutputGrid::new([640, 640], [84, 8400]).unwrap_err().contains("84 rows of 8400"));
        assert!(OutputGrid::new([416, 416], [3549, 5]).is_err(), "no class");
        assert!(OutputGrid::new([424, 416], [3549, 85]).unwrap_err().contains("424x416"));
        assert!(OutputGrid::new([0, 416], [0, 85]).is_err());
    }
}
