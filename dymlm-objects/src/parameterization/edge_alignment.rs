use std::f64::consts::FRAC_PI_2;

/// Finds the direction of a footprint's straight lines: a screen's panel, the legs of an L, the sides of a
/// box.
///
/// The points' places along and across a direction pile up when the footprint's lines run in that direction,
/// wherever these lines are; the direction wins in which most pairs of points have the same place. This
/// minimizes Renyi's quadratic entropy of the two projections. O(64 n) for n points, of which at most 256 are
/// used.
#[derive(Debug, Clone, Default)]
pub(super) struct EdgeAlignment {
    points: Vec<[f64; 2]>,
    places: Vec<f64>,
    bins: Vec<u32>,
}

/// Directions tried in a quarter turn.
const STEPS: i32 = 48;
/// Directions tried between the best of them and each of its neighbours.
const FINE_STEPS: i32 = 8;
/// Most points used.
const MAX_POINTS: usize = 256;
/// Points are at the same place when they are nearer to each other than this share of the footprint's root
/// mean square radius. A lower value follows noise, a higher one finds no sides on a chair.
const SAME_PLACE: f64 = 0.06;
/// Number of bins in which places are the same.
const BINS: usize = 4;

impl EdgeAlignment {
    /// The direction of a line, a unit vector within a quarter turn of the first axis; `None` when all points
    /// are in one place.
    pub(super) fn find(&mut self, footprint: &[[f64; 2]]) -> Option<[f64; 2]> {
        let step = footprint.len().div_ceil(MAX_POINTS).max(1);
        self.points.clear();
        self.points.extend(footprint.iter().step_by(step));
        let width = SAME_PLACE * self.radius();
        if !(width > 0.0 && width.is_finite()) {
            return None;
        }
        let turn = FRAC_PI_2 / f64::from(STEPS);
        let coarse = self.best((0..STEPS).map(|index| f64::from(index) * turn), width);
        let fine = |index: i32| coarse + f64::from(index) / f64::from(FINE_STEPS) * turn;
        // The coarse one comes first, so that none that is only as good takes its place.
        let best = self.best([coarse].into_iter().chain((-FINE_STEPS..=FINE_STEPS).map(fine)), width);
        let (sin, cos) = best.sin_cos();
        Some([cos, sin])
    }

    /// The first of the angles in whose direction most pairs of points have the same place.
    fn best(&mut self, angles: impl Iterator<Item = f64>, width: f64) -> f64 {
        let (mut best, mut most) = (0.0, 0);
        for angle in angles {
            let (sin, cos) = angle.sin_cos();
            let pairs = self.pairs([cos, sin], width) + self.pairs([-sin, cos], width);
            if pairs > most {
                (best, most) = (angle, pairs);
            }
        }
        best
    }

    /// Root mean square distance of the points from their middle.
    fn radius(&self) -> f64 {
        let count = self.points.len().max(1) as f64;
        let middle = [0, 1].map(|k| self.points.iter().map(|point| point[k]).sum::<f64>() / count);
        let square = |point: &[f64; 2]| (point[0] - middle[0]).powi(2) + (point[1] - middle[1]).powi(2);
        (self.points.iter().map(square).sum::<f64>() / count).sqrt()
    }

    /// How many pairs of points have about the same place along an axis: each counts more the nearer its
    /// places are, and nothing when they are `width` apart.
    fn pairs(&mut self, axis: [f64; 2], width: f64) -> u32 {
        let Self { points, places, bins } = self;
        places.clear();
        places.extend(points.iter().map(|point| axis[0] * point[0] + axis[1] * point[1]));
        let low = places.iter().copied().fold(f64::INFINITY, f64::min);
        // Windows of some bins slide over the places; all points in one are pairs. No point is further from
        // another than 2 sqrt(n) radii, so there are few bins.
        bins.clear();
        for place in places.iter() {
            let bin = ((place - low) / width * BINS as f64) as usize + BINS - 1;
            if bins.len() < bin + BINS {
                bins.resize(bin + BINS, 0);
            }
            bins[bin] += 1;
        }
        bins.windows(BINS).map(|window| window.iter().sum::<u32>().pow(2)).sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_l_is_aligned_with_its_legs() {
        // Front of 0.4 m, right side of 0.2 m; turned by 0.4 rad.
        let front = (0..40).map(|k| [0.01 * f64::from(k), 0.0]);
        let side = (0..20).map(|k| [0.4, 0.01 * f64::from(k)]);
        let (sin, cos) = 0.4_f64.sin_cos();
        let points: Vec<[f64; 2]> =
            front.chain(side).map(|[x, y]| [cos * x - sin * y, sin * x + cos * y]).collect();
        let [x, y] = EdgeAlignment::default().find(&points).unwrap();
        assert!((y.atan2(x) - 0.4).abs() < 0.01, "{}", y.atan2(x));
    }

    /// A screen's panel stands in the middle of its foot, so the smallest rectangle around both is turned.
    #[test]
    fn a_screen_is_aligned_with_its_panel_whatever_its_foot() {
        let noise = |k: i32| f64::from(k * 37 % 11 - 5) * 0.0005;
        let panel = (0..54).flat_map(|k| [[0.01 * f64::from(k), noise(k)]; 3]);
        let foot = (0..60).map(|k| [0.2 + 0.01 * f64::from(k % 12), 0.018 * f64::from(k / 12) - 0.09]);
        let points: Vec<[f64; 2]> = panel.chain(foot).collect();
        for angle in [0.0, 0.2, 0.7, 1.3] {
            let (sin, cos) = f64::sin_cos(angle);
            let turned: Vec<[f64; 2]> =
                points.iter().map(|[x, y]| [cos * x - sin * y, sin * x + cos * y]).collect();
            let [x, y] = EdgeAlignment::default().find(&turned).unwrap();
            assert!((y.atan2(x) - angle).abs() < 0.015, "{angle}: {}", y.atan2(x));
        }
    }

    #[test]
    fn nothing_is_aligned_with_nothing() {
        assert_eq!(EdgeAlignment::default().find(&[]), None);
        assert_eq!(EdgeAlignment::default().find(&[[1.0, 2.0]; 9]), None);
        assert_eq!(EdgeAlignment::default().find(&[[f64::MAX, 2.0], [0.0, 1.0]]), None);
    }
}
