/// Finds the rectangle along whose sides the points of a footprint lie.
///
/// Directions are tried in steps over a quarter turn. Of those whose rectangle is nearly as small as the
/// smallest, the one with the greatest closeness wins: the sum over the points of 1 / max(d, d0), where d is
/// the distance to the nearest side. O(48 n) for n points, of which at most 256 are used.
///
/// Zhang, Xu, Dong, Dolan: "Efficient L-Shape Fitting for Vehicle Detection Using Laser Scanners", IV 2017
/// (the closeness criterion).
#[derive(Debug, Clone, Default)]
pub(super) struct EdgeAlignment {
    places: Vec<[f64; 2]>,
    along: Vec<f64>,
    across: Vec<f64>,
    sorted: Vec<f64>,
}

/// Directions tried in a quarter turn.
const STEPS: usize = 48;
/// Most points used.
const MAX_POINTS: usize = 256;
/// Distances below this share of the square root of the rectangle's area are noise.
const NOISE_SHARE: f64 = 0.06;
/// Factor by which a rectangle along the edges may be larger than the smallest one.
const SLACK: f64 = 1.25;
/// Factor by which the closeness must exceed that of the given axes.
const GAIN: f64 = 1.05;

#[derive(Debug, Clone, Copy)]
struct Candidate {
    axis: [f64; 2],
    area: f64,
    closeness: f64,
}

impl EdgeAlignment {
    /// The direction of a side, when a share `trim` of the points is left out at each end; `None` when the
    /// given axes are as good.
    pub(super) fn find(&mut self, footprint: &[[f64; 2]], trim: f64) -> Option<[f64; 2]> {
        let step = footprint.len().div_ceil(MAX_POINTS).max(1);
        self.places.clear();
        self.places.extend(footprint.iter().step_by(step));
        let mut best: Option<Candidate> = None;
        let given = self.measure([1.0, 0.0], trim)?;
        let candidates: [Option<Candidate>; STEPS] = std::array::from_fn(|index| {
            let (sin, cos) = (index as f64 * std::f64::consts::FRAC_PI_2 / STEPS as f64).sin_cos();
            self.measure([cos, sin], trim)
        });
        let least = candidates.iter().flatten().map(|candidate| candidate.area).fold(given.area, f64::min);
        for candidate in candidates.into_iter().flatten().filter(|candidate| candidate.area <= SLACK * least)
        {
            if best.is_none_or(|best| candidate.closeness > best.closeness) {
                best = Some(candidate);
            }
        }
        let is_poor = given.area > SLACK * least;
        best.filter(|best| is_poor || best.closeness > GAIN * given.closeness).map(|best| best.axis)
    }

    fn measure(&mut self, axis: [f64; 2], trim: f64) -> Option<Candidate> {
        let [x, y] = axis;
        self.along.clear();
        self.across.clear();
        for place in &self.places {
            self.along.push(x * place[0] + y * place[1]);
            self.across.push(x * place[1] - y * place[0]);
        }
        let Self { along, across, sorted, .. } = self;
        let mut extent = |values: &[f64]| {
            sorted.clear();
            sorted.extend_from_slice(values);
            trimmed_extent(sorted, trim)
        };
        let ([left, right], [low, high]) = (extent(along)?, extent(across)?);
        let area = (right - left) * (high - low);
        let noise = NOISE_SHARE * area.max(0.0).sqrt();
        if noise <= 0.0 {
            return None;
        }
        let closeness = along.iter().zip(across.iter()).map(|(along, across)| {
            let to_end = (along - left).abs().min((right - along).abs());
            let to_side = (across - low).abs().min((high - across).abs());
            noise / to_end.min(to_side).max(noise)
        });
        Some(Candidate { axis, area, closeness: closeness.sum() })
    }
}

/// Least and greatest value when the share `trim` is left out at each end; `None` when there are no values.
pub(super) fn trimmed_extent(values: &mut [f64], trim: f64) -> Option<[f64; 2]> {
    let last = values.len().checked_sub(1)?;
    let left_out = ((trim * values.len() as f64) as usize).min(last / 2);
    let low = *values.select_nth_unstable_by(left_out, f64::total_cmp).1;
    let high = *values.select_nth_unstable_by(last - left_out, f64::total_cmp).1;
    Some([low, high])
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
        let [x, y] = EdgeAlignment::default().find(&points, 0.02).unwrap();
        assert!((y.atan2(x) - 0.4).abs() < 0.05, "{}", y.atan2(x));
    }

    #[test]
    fn the_outermost_are_left_out() {
        let mut values: Vec<f64> = (0..100).map(|k| f64::from(k * 37 % 100)).collect();
        assert_eq!(trimmed_extent(&mut values, 0.02), Some([2.0, 97.0]));
        assert_eq!(trimmed_extent(&mut [3.0, -1.0], 0.02), Some([-1.0, 3.0]));
        assert_eq!(trimmed_extent(&mut [], 0.02), None);
    }

    #[test]
    fn nothing_is_aligned_with_nothing() {
        assert_eq!(EdgeAlignment::default().find(&[], 0.0), None);
        assert_eq!(EdgeAlignment::default().find(&[[1.0, 2.0]; 9], 0.0), None);
    }
}
