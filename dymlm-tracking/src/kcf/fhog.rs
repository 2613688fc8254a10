use std::f32::consts::PI;

/// Channels of a cell: 18 signed orientations, 9 unsigned ones, 4 of texture.
pub(super) const CHANNELS: usize = 31;

const UNSIGNED: usize = 9;
const SIGNED: usize = 18;

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
/// outside the border repeat it. O(pixels x 9).
#[derive(Debug, Clone)]
pub(super) struct Fhog {
    cells: [usize; 2],
    cell: usize,
    /// For each pixel of a row, the left one of its two cells (in the padded histogram) and that cell's
    /// weight; `row_votes` likewise for the pixels of a column.
    column_votes: Vec<Vote>,
    row_votes: Vec<Vote>,
    length: Vec<f32>,
    orientation: Vec<i32>,
    /// 18 entries for each cell, with a ring of one cell around the template.
    histogram: Vec<f32>,
    energy: Vec<f32>,
    /// 1 / norm of the 2x2 block of cells around each corner between cells.
    inverse_norm: Vec<f32>,
}

#[derive(Debug, Clone, Copy)]
struct Vote {
    lower: usize,
    lower_weight: f32,
}

impl Fhog {
    /// For templates of `cells` cells with `cell` pixels a side.
    pub(super) fn new(cells: [usize; 2], cell: usize) -> Self {
        let votes = |count: usize| {
            let place = |i: usize| (i as f32 + 0.5) / cell as f32 + 0.5;
            (0..count * cell)
                .map(|i| Vote { lower: place(i) as usize, lower_weight: 1.0 - place(i).fract() })
                .collect()
        };
        let width = cells[0] * cell;
        Self {
            cells,
            cell,
            column_votes: votes(cells[0]),
            row_votes: votes(cells[1]),
            length: vec![0.0; width],
            orientation: vec![0; width],
            histogram: vec![0.0; (cells[0] + 2) * (cells[1] + 2) * SIGNED],
            energy: vec![0.0; cells[0] * cells[1]],
            inverse_norm: vec![0.0; (cells[0] + 1) * (cells[1] + 1)],
        }
    }

    /// Computes the channels of a template, one channel after the other: `channels[c * cells + cell]`.
    pub(super) fn compute(&mut self, template: &[f32], channels: &mut [f32]) {
        self.vote(template);
        self.measure_blocks();
        self.normalize(channels);
    }

    fn vote(&mut self, template: &[f32]) {
        self.histogram.fill(0.0);
        let width = self.cells[0] * self.cell;
        let height = self.cells[1] * self.cell;
        let row = |v: usize| template.get(v * width..(v + 1) * width).unwrap_or(&[]);
        let stride = (self.cells[0] + 2) * SIGNED;
        for v in 0..height {
            let [above, here, below] = [row(v.saturating_sub(1)), row(v), row((v + 1).min(height - 1))];
            orient(above, here, below, &mut self.length, &mut self.orientation);
            let vote = self.row_votes[v];
            let (upper, lower) = (vote.lower_weight, 1.0 - vote.lower_weight);
            let Some(rows) = self.histogram.get_mut(vote.lower * stride..(vote.lower + 2) * stride) else {
                return;
            };
            let (upper_row, lower_row) = rows.split_at_mut(stride);
            let pixels = self.column_votes.iter().zip(&self.length).zip(&self.orientation);
            for ((column, &length), &orientation) in pixels {
                let left = column.lower * SIGNED + orientation as usize;
                let right = left + SIGNED;
                let (left_share, right_share) =
                    (column.lower_weight * length, (1.0 - column.lower_weight) * length);
                upper_row[left] += upper * left_share;
                upper_row[right] += upper * right_share;
                lower_row[left] += lower * left_share;
                lower_row[right] += lower * right_share;
            }
        }
    }

    fn measure_blocks(&mut self) {
        let [nx, ny] = self.cells;
        for y in 0..ny {
            for x in 0..nx {
                let (signed, opposite) = self.cell_histogram(x, y).split_at(UNSIGNED);
                let energy = signed.iter().zip(opposite).map(|(a, b)| (a + b) * (a + b)).sum();
                self.energy[y * nx + x] = energy;
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

    fn normalize(&self, channels: &mut [f32]) {
        let [nx, ny] = self.cells;
        let count = nx * ny;
        for y in 0..ny {
            for x in 0..nx {
                let corner = y * (nx + 1) + x;
                let norms =
                    [corner, corner + 1, corner + nx + 1, corner + nx + 2].map(|i| self.inverse_norm[i]);
                let histogram = self.cell_histogram(x, y);
                let cell = y * nx + x;
                let mut texture = [0.0; 4];
                for (o, &entry) in histogram.iter().enumerate() {
                    let clipped = norms.map(|norm| (entry * norm).min(CLIP));
                    for (sum, entry) in texture.iter_mut().zip(clipped) {
                        *sum += entry;
                    }
                    channels[o * count + cell] = 0.5 * clipped.iter().sum::<f32>();
                }
                let (signed, opposite) = histogram.split_at(UNSIGNED);
                for (o, (a, b)) in signed.iter().zip(opposite).enumerate() {
                    let clipped = norms.map(|norm| ((a + b) * norm).min(CLIP));
                    channels[(SIGNED + o) * count + cell] = 0.5 * clipped.iter().sum::<f32>();
                }
                // Divided by the square root of the number of summed entries, to make texture about as large
                // as the others.
                let scale = 1.0 / (SIGNED as f32).sqrt();
                for (o, sum) in texture.iter().enumerate() {
                    channels[(SIGNED + UNSIGNED + o) * count + cell] = scale * sum;
                }
            }
        }
    }

    #[inline]
    fn cell_histogram(&self, x: usize, y: usize) -> &[f32] {
        let first = ((y + 1) * (self.cells[0] + 2) + x + 1) * SIGNED;
        self.histogram.get(first..first + SIGNED).unwrap_or(&[])
    }
}

/// Length and orientation (0..18) of the gradient at each pixel of a row, by central differences.
fn orient(above: &[f32], here: &[f32], below: &[f32], length: &mut [f32], orientation: &mut [i32]) {
    let directions: [[f32; 2]; UNSIGNED] = std::array::from_fn(|o| {
        let angle = o as f32 * PI / UNSIGNED as f32;
        [angle.cos(), angle.sin()]
    });
    let last = here.len() - 1;
    // First the differences along the row, whose two ends are separate; then the rest without a branch.
    length[0] = here[1.min(last)] - here[0];
    length[last] = here[last] - here[last.saturating_sub(1)];
    for (dx, pair) in length.iter_mut().skip(1).zip(here.windows(3)) {
        *dx = pair[2] - pair[0];
    }
    let columns = length.iter_mut().zip(orientation.iter_mut()).zip(above.iter().zip(below));
    for ((length, orientation), (above, below)) in columns {
        let (dx, dy) = (*length, below - above);
        let (mut best, mut chosen) = (0.0, 0);
        for (o, [cos, sin]) in directions.iter().enumerate() {
            let along = cos * dx + sin * dy;
            let signed = o as i32 + if along < 0.0 { UNSIGNED as i32 } else { 0 };
            chosen = if along.abs() > best { signed } else { chosen };
            best = best.max(along.abs());
        }
        *orientation = chosen;
        *length = (dx * dx + dy * dy).sqrt();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channels(template: &[f32], cells: [usize; 2]) -> Vec<f32> {
        let mut channels = vec![0.0; CHANNELS * cells[0] * cells[1]];
        Fhog::new(cells, 4).compute(template, &mut channels);
        channels
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
