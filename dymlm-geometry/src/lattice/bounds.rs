use dymlm_core::Point;

use crate::finite::is_finite;

/// Least and greatest coordinates of the finite points.
pub(super) struct Bounds {
    pub(super) min: Point,
    pub(super) max: Point,
    pub(super) all_finite: bool,
}

impl Bounds {
    /// `None` when there is no finite point.
    pub(super) fn of(points: &[Point]) -> Option<Self> {
        let all = Self::of_finite(points);
        if all.all_finite && !points.is_empty() {
            return Some(all);
        }
        // Rare enough for one point at a time.
        let finite = points.iter().filter(|point| is_finite(point)).map(|point| Self::of_finite(&[*point]));
        let bounds = finite.reduce(|a, b| a.and(&b))?;
        Some(Self { all_finite: false, ..bounds })
    }

    /// The bounds of points if all are finite, four at a time in vector registers.
    fn of_finite(points: &[Point]) -> Self {
        const LANES: usize = 12;
        let mut min = [f32::INFINITY; LANES];
        let mut max = [f32::NEG_INFINITY; LANES];
        let mut not_finite = [0.0; LANES];
        let (fours, rest) = points.as_chunks::<4>();
        // The rest as four points, the last one repeated.
        let last = rest.last().map(|last| std::array::from_fn(|i| *rest.get(i).unwrap_or(last)));
        for four in fours.iter().chain(&last) {
            for ((lane, &x), not_finite) in four.as_flattened().iter().enumerate().zip(&mut not_finite) {
                min[lane] = if x < min[lane] { x } else { min[lane] };
                max[lane] = if x > max[lane] { x } else { max[lane] };
                // NaN for NaN and the infinities.
                *not_finite += 0.0 * x;
            }
        }
        let axis = |lanes: &[f32; LANES], axis: usize, better: fn(f32, f32) -> f32| {
            lanes.iter().skip(axis).step_by(3).copied().reduce(better).unwrap_or_default()
        };
        Self {
            min: std::array::from_fn(|i| axis(&min, i, f32::min)),
            max: std::array::from_fn(|i| axis(&max, i, f32::max)),
            all_finite: not_finite.iter().all(|&sum| sum == 0.0),
        }
    }

    fn and(&self, other: &Self) -> Self {
        Self {
            min: std::array::from_fn(|axis| self.min[axis].min(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].max(other.max[axis])),
            all_finite: self.all_finite && other.all_finite,
        }
    }
}
