use wide::f32x4;

use super::lanes::LANES;

/// Side of a cell, pixels of the template: that of the published settings.
pub(super) const CELL: usize = 4;
/// Number of vectors of a cell's 31 channels: 18 signed orientations, 9 unsigned ones, 4 of texture. One
/// place is free. In order: the orientations 0 to 7, then 9 to 16, the unsigned ones 0 to 7; then 8, 17, the
/// unsigned 8 and the free place; then texture.
pub(super) const VECTORS: usize = 8;

/// Vectors of a cell's histogram: the orientations 0 to 7, then 9 to 16, then 8 and 17.
type Histogram = [f32x4; 5];

const SIGNED: usize = 18;
/// Tangents of the angles 10, 30, 50 and 70 degrees between the orientations of a quadrant.
const BOUNDARIES: [f32; 4] = [0.176_326_98, 0.577_350_26, 1.191_753_6, 2.747_477_5];
/// Added to the number of an orientation within its quadrant, counted from the horizontal, when the gradient
/// points to the left, and when it points upwards.
const LEFTWARD: f32 = 8.0;
const UPWARD: f32 = 16.0;
/// Number of codes of a quadrant and an orientation in it.
const CODES: usize = 32;
/// The codes of the orientations in a histogram's order. Gradients near the horizontal have two codes.
const CODE_OF: [usize; SIGNED] = [0, 1, 2, 3, 4, 12, 11, 10, 8, 25, 26, 27, 28, 20, 19, 18, 9, 17];
const SAME_CODES: [[usize; 2]; 2] = [[0, 16], [8, 24]];

/// Upper limit of histogram entries after normalization.
const CLIP: f32 = 0.2;
/// Added to a block's energy, so that gradients of about 1e-3, which are noise, stay small.
const EPSILON: f32 = 1e-4;

/// Histograms of oriented gradients with contrast-sensitive and insensitive orientations and texture:
/// Felzenszwalb, Girshick, `McAllester`, Ramanan: "Object Detection with Discriminatively Trained Part-Based
/// Models", TPAMI 2010, section 6.
///
/// Each pixel votes with its gradient's length for one of 18 orientations in the four nearest cells,
/// bilinearly. Each cell is normalized by each of its four 2x2 blocks, and the four results are added. Cells
/// outside the border repeat it. O(pixels).
#[derive(Debug, Clone)]
pub(super) struct Fhog {
    cells: [usize; 2],
    /// For each pixel of a square of 4x4 between the centres of four cells, its shares of the cells: upper
    /// left, upper right, lower left, lower right.
    shares: [[f32x4; CELL]; CELL],
    /// Four rows of gradients, with half a cell of zeros at each end.
    gradients: [GradientRow; CELL],
    /// A histogram for each cell, with a ring of one cell around the template.
    histograms: Vec<Histogram>,
    energy: Vec<f32>,
    /// 1 / norm of the 2x2 block of cells around each corner between cells.
    inverse_norm: Vec<f32>,
}

/// The gradients of a row of pixels.
#[derive(Debug, Clone, Default)]
struct GradientRow {
    length: Vec<f32>,
    /// Quadrant and orientation in it.
    code: Vec<i32>,
}

impl Fhog {
    /// For templates of `cells` cells.
    pub(super) fn new(cells: [usize; 2]) -> Self {
        let [nx, ny] = cells;
        let share = |i: usize| (i as f32 + 0.5) / CELL as f32;
        let shares = std::array::from_fn(|y| {
            std::array::from_fn(|x| {
                let ([left, right], [upper, lower]) =
                    ([1.0 - share(x), share(x)], [1.0 - share(y), share(y)]);
                f32x4::new([upper * left, upper * right, lower * left, lower * right])
            })
        });
        let width = (nx + 1) * CELL;
        let row = GradientRow { length: vec![0.0; width], code: vec![0; width] };
        Self {
            cells,
            shares,
            gradients: std::array::from_fn(|_| row.clone()),
            histograms: vec![[f32x4::ZERO; 5]; (nx + 2) * (ny + 2)],
            energy: vec![0.0; nx * ny],
            inverse_norm: vec![0.0; (nx + 1) * (ny + 1)],
        }
    }

    /// Computes the channels of a template, and passes each cell's to `take`, row by row.
    pub(super) fn compute(&mut self, template: &[f32], take: impl FnMut([f32x4; VECTORS])) {
        self.vote(template);
        self.measure_blocks();
        self.normalize(take);
    }

    /// Collects the votes of each square between four cells, and adds them to these cells.
    fn vote(&mut self, template: &[f32]) {
        self.histograms.fill([f32x4::ZERO; 5]);
        let [nx, ny] = self.cells;
        for lower in 0..=ny {
            self.measure_gradients(template, lower);
            let bands = self.histograms.get_mut(lower * (nx + 2)..).unwrap_or(&mut []);
            let Some((upper_cells, lower_cells)) = bands.split_at_mut_checked(nx + 2) else { return };
            for square in 0..=nx {
                let votes = collect_votes(&self.gradients, &self.shares, square);
                let cells =
                    (upper_cells.get_mut(square..square + 2), lower_cells.get_mut(square..square + 2));
                if let (Some([upper_left, upper_right]), Some([lower_left, lower_right])) = cells {
                    add_votes(&votes, [upper_left, upper_right, lower_left, lower_right]);
                }
            }
        }
    }

    /// Measures the four rows of pixels around the border above the row `lower` of cells.
    fn measure_gradients(&mut self, template: &[f32], lower: usize) {
        let width = self.cells[0] * CELL;
        let height = self.cells[1] * CELL;
        let row = |v: usize| template.get(v * width..(v + 1) * width).unwrap_or(&[]);
        for (y, target) in self.gradients.iter_mut().enumerate() {
            // Rows outside the template have no gradients.
            match (lower * CELL + y).checked_sub(CELL / 2).filter(|&v| v < height) {
                Some(v) => target.measure([row(v.saturating_sub(1)), row(v), row((v + 1).min(height - 1))]),
                None => target.length.fill(0.0),
            }
        }
    }

    fn measure_blocks(&mut self) {
        let [nx, ny] = self.cells;
        for (y, row) in self.energy.chunks_exact_mut(nx).enumerate() {
            let histograms = self.histograms.get((y + 1) * (nx + 2) + 1..).unwrap_or(&[]);
            for (energy, &[a0, a1, b0, b1, rest]) in row.iter_mut().zip(histograms) {
                let [a, b, ..] = rest.to_array();
                let [first, second] = [a0 + b0, a1 + b1];
                let squares = (first * first + second * second).to_array();
                *energy = squares.iter().sum::<f32>() + (a + b) * (a + b);
            }
        }
        for y in 0..=ny {
            for x in 0..=nx {
                let columns = [x.saturating_sub(1), x.min(nx - 1)];
                let rows = [y.saturating_sub(1), y.min(ny - 1)];
                let energy: f32 = rows
                    .iter()
                    .flat_map(|y| columns.iter().map(move |x| (x, y)))
                    .map(|(x, y)| self.energy[y * nx + x])
                    .sum();
                self.inverse_norm[y * (nx + 1) + x] = 1.0 / (energy + EPSILON).sqrt();
            }
        }
    }

    fn normalize(&self, mut take: impl FnMut([f32x4; VECTORS])) {
        let [nx, ny] = self.cells;
        for y in 0..ny {
            let histograms = self.histograms.get((y + 1) * (nx + 2) + 1..).unwrap_or(&[]);
            let [upper, lower] =
                [y, y + 1].map(|y| self.inverse_norm.get(y * (nx + 1)..(y + 1) * (nx + 1)).unwrap_or(&[]));
            for ((histogram, upper), lower) in histograms.iter().zip(upper.windows(2)).zip(lower.windows(2)) {
                take(normalize_cell(histogram, [upper[0], upper[1], lower[0], lower[1]]));
            }
        }
    }
}

impl GradientRow {
    /// Lengths and codes of the gradients of the row between two others, by central differences.
    fn measure(&mut self, [above, here, below]: [&[f32]; 3]) {
        let (margin, width) = (CELL / 2, here.len());
        let (Some(length), Some(code)) =
            (self.length.get_mut(margin..margin + width), self.code.get_mut(margin..margin + width))
        else {
            return;
        };
        let Some(last) = width.checked_sub(1) else { return };
        // First the differences along the row, whose two ends are separate; then the rest without a branch.
        length[0] = here[1.min(last)] - here[0];
        length[last] = here[last] - here[last.saturating_sub(1)];
        for (dx, pair) in length.iter_mut().skip(1).zip(here.windows(3)) {
            *dx = pair[2] - pair[0];
        }
        let targets = length.as_chunks_mut::<LANES>().0.iter_mut().zip(code.as_chunks_mut::<LANES>().0);
        let columns = above.as_chunks::<LANES>().0.iter().zip(below.as_chunks::<LANES>().0);
        for ((length, code), (above, below)) in targets.zip(columns) {
            let (dx, dy) = (f32x4::new(*length), f32x4::new(*below) - f32x4::new(*above));
            let (across, down) = (dx.abs(), dy.abs());
            // Masks become numbers by a bitwise and.
            let mut number = (dx.simd_lt(f32x4::ZERO) & f32x4::splat(LEFTWARD))
                + (dy.simd_lt(f32x4::ZERO) & f32x4::splat(UPWARD));
            for boundary in BOUNDARIES {
                number += down.simd_gt(across * boundary) & f32x4::ONE;
            }
            *code = number.fast_trunc_int().to_array();
            *length = (dx * dx + dy * dy).sqrt().to_array();
        }
    }
}

/// The votes of the pixels of a square between four cells, by code, with their shares of the cells in the
/// lanes.
#[inline]
fn collect_votes(
    gradients: &[GradientRow; CELL],
    shares: &[[f32x4; CELL]; CELL],
    square: usize,
) -> [f32x4; CODES] {
    let mut votes = [f32x4::ZERO; CODES];
    for (row, shares) in gradients.iter().zip(shares) {
        let lengths = row.length.as_chunks::<CELL>().0.get(square).unwrap_or(&[0.0; CELL]);
        let codes = row.code.as_chunks::<CELL>().0.get(square).unwrap_or(&[0; CELL]);
        for ((&length, &code), &share) in lengths.iter().zip(codes).zip(shares) {
            votes[code as usize % CODES] += share * length;
        }
    }
    votes
}

/// Adds votes to the histograms of the cells upper left, upper right, lower left and lower right.
#[inline]
fn add_votes(votes: &[f32x4; CODES], cells: [&mut Histogram; 4]) {
    let mut in_order = CODE_OF.map(|code| votes[code]);
    for [code, other] in SAME_CODES {
        if let Some(place) = CODE_OF.iter().position(|&known| known == code) {
            in_order[place] += votes[other];
        }
    }
    let (whole, rest) = in_order.as_chunks::<LANES>();
    let rest = [rest[0], rest[1], f32x4::ZERO, f32x4::ZERO];
    let mut by_cell = [[f32x4::ZERO; 5]; 4];
    for (k, &entries) in whole.iter().chain([&rest]).enumerate() {
        for (cell, entries) in by_cell.iter_mut().zip(f32x4::transpose(entries)) {
            cell[k] = entries;
        }
    }
    for (cell, entries) in cells.into_iter().zip(by_cell) {
        cell.iter_mut().zip(entries).for_each(|(sum, entry)| *sum += entry);
    }
}

/// The channels of a cell from its histogram and the inverse norms of its four blocks.
#[inline]
fn normalize_cell(&[a0, a1, b0, b1, rest]: &Histogram, norms: [f32; 4]) -> [f32x4; VECTORS] {
    let norms = norms.map(f32x4::splat);
    let clip = f32x4::splat(CLIP);
    let clipped = |entries: f32x4| norms.map(|norm| (entries * norm).fast_min(clip));
    let total = |[a, b, c, d]: [f32x4; 4]| (a + b + c + d) * 0.5;

    let signed = [a0, a1, b0, b1].map(clipped);
    let [a, b, ..] = rest.to_array();
    let rest = clipped(f32x4::new([a, b, a + b, 0.0]));
    // The sum of all signed orientations for each of the four blocks.
    let is_signed = f32x4::new([1.0, 1.0, 0.0, 0.0]);
    let texture: [f32x4; 4] = std::array::from_fn(|block| {
        signed.iter().map(|entries| entries[block]).sum::<f32x4>() + rest[block] * is_signed
    });
    let [a, b, c, d] = f32x4::transpose(texture);
    // Divided by the square root of the number of summed entries, to make texture about as large as the
    // others.
    let scale = 1.0 / (SIGNED as f32).sqrt();

    let [v0, v1, v2, v3] = signed.map(total);
    let [v4, v5] = [a0 + b0, a1 + b1].map(|unsigned| total(clipped(unsigned)));
    [v0, v1, v2, v3, v4, v5, total(rest), (a + b + c + d) * scale]
}

#[cfg(test)]
mod tests {
    use std::f32::consts::PI;

    use super::*;

    const UNSIGNED: usize = 9;

    /// The channels one after the other, in Felzenszwalb's order: `channels[c * cells + cell]`.
    fn channels(template: &[f32], cells: [usize; 2]) -> Vec<f32> {
        let places = (0..8).chain([24]).chain(8..16).chain([25]).chain(16..24).chain([26]).chain(28..32);
        let mut of_cells: Vec<Vec<f32>> = Vec::new();
        Fhog::new(cells).compute(template, |vectors| {
            of_cells.push(vectors.iter().flat_map(|vector| vector.to_array()).collect());
        });
        assert_eq!(of_cells.len(), cells[0] * cells[1]);
        places.flat_map(|place| of_cells.iter().map(move |values| values[place])).collect()
    }

    /// A ramp of 32x32 pixels that rises along the direction `angle`, radians.
    fn ramp(angle: f32) -> Vec<f32> {
        (0..1024).map(|i| 0.03 * ((i % 32) as f32 * angle.cos() + (i / 32) as f32 * angle.sin())).collect()
    }

    #[test]
    fn a_ramp_has_one_orientation_of_known_strength() {
        for o in 0..SIGNED {
            let angle = o as f32 * PI / UNSIGNED as f32;
            let found = channels(&ramp(angle), [8, 8]);
            let inner = 3 * 8 + 3;
            for c in 0..SIGNED + UNSIGNED {
                let value = found[c * 64 + inner];
                let expected = c == o || c == SIGNED + o % UNSIGNED;
                // In a block of four equal cells, each has 1/2; clipped to 0.2, summed four times, halved:
                // 0.4.
                let expected = if expected { 0.4 } else { 0.0 };
                assert!((value - expected).abs() < 1e-3, "orientation {o}, channel {c}: {value}");
            }
            for c in 27..31 {
                assert!((found[c * 64 + inner] - CLIP / (SIGNED as f32).sqrt()).abs() < 1e-3);
            }
        }
    }

    #[test]
    fn contrast_does_not_matter_but_its_sign_does() {
        let template: Vec<f32> = (0..1024)
            .map(|i| 0.5 + 0.3 * (0.7 * (i % 32) as f32).sin() * (0.45 * (i / 32) as f32).cos())
            .collect();
        let weak: Vec<f32> = template.iter().map(|value| 0.3 + 0.4 * value).collect();
        let negative: Vec<f32> = template.iter().map(|value| 1.0 - value).collect();
        let (a, b, c) = (channels(&template, [8, 8]), channels(&weak, [8, 8]), channels(&negative, [8, 8]));
        for cell in 0..64 {
            for o in 0..UNSIGNED {
                assert!((a[o * 64 + cell] - b[o * 64 + cell]).abs() < 0.01);
                assert!((a[o * 64 + cell] - c[(o + UNSIGNED) * 64 + cell]).abs() < 1e-4);
                assert!((a[(SIGNED + o) * 64 + cell] - c[(SIGNED + o) * 64 + cell]).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn a_flat_template_has_no_gradients() {
        assert!(channels(&[0.5; 1024], [8, 8]).iter().all(|&value| value == 0.0));
    }
}
