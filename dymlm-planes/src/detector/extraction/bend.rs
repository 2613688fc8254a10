use dymlm_core::vector3::{difference, dot};

use crate::linear_algebra::plane_axes;
use crate::moments::Fit;

/// Terms of a quadratic surface over a plane: 1, u, v, uu, uv, vv; the first three describe a plane.
const TERMS: usize = 6;
const LINEAR: usize = 3;
/// Least ratio of what the three quadratic terms explain of the blocks' distances to the remaining error (an
/// F statistic) in a bent plane. With less, noise bends far planes; with more, pillars beyond 3 m become
/// facets.
const SIGNIFICANT: f64 = 10.0;
/// Largest angle by which a plane turns from one side to the other, radians. With 0.2 the bend of a Kinect's
/// readings costs real walls a tenth of their observations (`kitchen_planes`); with more, more strips of
/// pillars are planes (0.2: precision 98 %, 0.3: 96 %, without the rule 88 % in building 77).
const MOST_TURN: f64 = 0.3;

/// Cosine of the largest angle between a plane and a block beside it that may continue it: 30 degrees, beyond
/// which there is an edge.
const COS_CONTINUED: f64 = 0.866_025;
/// Tangent of half that angle.
const RISE: f64 = 0.267_949;

/// The bend of a plane: sums for the quadratic surface through the centroids of its blocks, or of these and the
/// blocks around it that continue it.
///
/// A strip of a round thing that is narrow or far away is as flat as the sensor's noise. But its misfit is
/// systematic, whereas noise, disparity steps included, is not: over some hundred blocks a curve shows that
/// no single block shows. And a face ends at an edge or a step, whereas beside a strip the surface goes on and
/// bends away.
#[derive(Debug, Clone)]
pub(super) struct Bend {
    fit: Fit,
    axes: [[f64; 3]; 2],
    matrix: [[f64; TERMS]; TERMS],
    right: [f64; TERMS],
    squares: f64,
    blocks: usize,
}

impl Bend {
    /// The sums without blocks; `fit` is the plane of all blocks.
    pub(super) fn new(fit: Fit) -> Self {
        let (matrix, right) = ([[0.0; TERMS]; TERMS], [0.0; TERMS]);
        Self { fit, axes: plane_axes(fit.normal), matrix, right, squares: 0.0, blocks: 0 }
    }

    /// Whether a flat block, up to `reach` metres beside the plane, may continue it: there is no edge between
    /// them, and no step beyond what a surface that turns as far as an edge would rise.
    pub(super) fn is_continued_by(&self, block: &Fit, reach: f64) -> bool {
        let distance = dot(self.fit.normal, difference(block.centroid, self.fit.centroid)).abs();
        dot(self.fit.normal, block.normal) > COS_CONTINUED && distance < RISE * reach
    }

    /// Adds a block with the centroid and the weight of its readings.
    pub(super) fn add(&mut self, centroid: [f64; 3], weight: f64) {
        let offset = difference(centroid, self.fit.centroid);
        let [u, v] = self.axes.map(|axis| dot(axis, offset));
        let distance = dot(self.fit.normal, offset);
        let terms = [1.0, u, v, u * u, u * v, v * v];
        for (i, term) in terms.into_iter().enumerate() {
            for (entry, other) in self.matrix[i].iter_mut().zip(&terms[..=i]) {
                *entry += weight * term * other;
            }
            self.right[i] += weight * term * distance;
        }
        self.squares += weight * distance * distance;
        self.blocks += 1;
    }

    /// Whether these are the blocks of `own` and more than half as many around them. A strip of a round thing
    /// goes on at all its blocks, at one of its sides at least; a face at hardly any.
    pub(super) fn extends(&self, own: &Self) -> bool {
        2 * self.blocks > 3 * own.blocks
    }

    /// Width of the blocks' centroids perpendicular to their longest extent, metres. Points spread evenly over
    /// a width w have the variance w^2 / 12.
    fn width(&self) -> f64 {
        let share = 1.0 / self.matrix[0][0];
        let [u, v] = [1, 2].map(|i| share * self.matrix[i][0]);
        let (uu, uv) = (share * self.matrix[1][1] - u * u, share * self.matrix[2][1] - u * v);
        let vv = share * self.matrix[2][2] - v * v;
        let across = 0.5 * (uu + vv - (uu - vv).hypot(2.0 * uv));
        (12.0 * across.max(0.0)).sqrt()
    }

    /// Whether the blocks are bent beyond noise. False when they are too few or in too few rows.
    ///
    /// Normal equations solved by Cholesky: the square of each entry of the forward solution is what its term
    /// takes off the sum of squares.
    pub(super) fn is_round(&self) -> bool {
        let mut lower = [[0.0; TERMS]; TERMS];
        let mut solved = [0.0; TERMS];
        for i in 0..TERMS {
            for j in 0..=i {
                let rest = self.matrix[i][j] - (0..j).map(|k| lower[i][k] * lower[j][k]).sum::<f64>();
                if i == j && rest <= 1e-9 * self.matrix[i][i] {
                    return false;
                }
                lower[i][j] = if i == j { rest.sqrt() } else { rest / lower[j][j] };
            }
            let known: f64 = (0..i).map(|k| lower[i][k] * solved[k]).sum();
            solved[i] = (self.right[i] - known) / lower[i][i];
        }
        let taken = |terms: &[f64]| terms.iter().map(|y| y * y).sum::<f64>();
        let free = self.blocks.saturating_sub(TERMS) as f64;
        let error = (self.squares - taken(&solved)).max(0.0) / free;
        let bend = taken(&solved[LINEAR..]) / (TERMS - LINEAR) as f64;
        // Back substitution for the quadratic coefficients, then the larger principal curvature.
        let vv = solved[5] / lower[5][5];
        let uv = (solved[4] - lower[5][4] * vv) / lower[4][4];
        let uu = (solved[3] - lower[4][3] * uv - lower[5][3] * vv) / lower[3][3];
        let curvature = (uu + vv).abs() + (uu - vv).hypot(uv);
        free > 0.0 && bend > SIGNIFICANT * error && curvature * self.width() > MOST_TURN
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A strip 0.2 m wide of a cylinder, or of its tangent plane, with errors of 1 mm that alternate.
    fn strip(radius: f64) -> Bend {
        let fit = Fit { centroid: [0.0, 0.0, 2.0], normal: [0.0, 0.0, -1.0], ..Fit::default() };
        let mut bend = Bend::new(fit);
        for (row, column) in (0..20).flat_map(|row| (0..8).map(move |column| (row, column))) {
            let (x, y) = (0.2 * (f64::from(column) / 7.0 - 0.5), 0.03 * f64::from(row));
            let error = if (row + column) % 2 == 0 { 1e-3 } else { -1e-3 };
            bend.add([x, y, 2.0 + x * x / (2.0 * radius) + error], 1.0);
        }
        bend
    }

    #[test]
    fn a_strip_of_a_pillar_is_round_and_one_of_a_wall_is_not() {
        assert!(strip(0.4).is_round());
        assert!(!strip(f64::INFINITY).is_round());
        // It turns by 0.01 rad over its width: too little to count as bent.
        assert!(!strip(20.0).is_round());
    }

    #[test]
    fn few_blocks_and_single_rows_tell_nothing() {
        let fit = Fit { centroid: [0.0, 0.0, 2.0], normal: [0.0, 0.0, -1.0], ..Fit::default() };
        let mut bend = Bend::new(fit);
        assert!(!bend.is_round());
        for column in 0..40 {
            let x = 0.01 * f64::from(column);
            bend.add([x, 0.0, 2.0 + x * x], 1.0);
        }
        assert!(!bend.is_round());
    }
}
