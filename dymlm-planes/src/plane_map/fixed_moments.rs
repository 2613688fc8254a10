use dymlm_core::vector3::dot;
use dymlm_core::{SymmetricEigen3, symmetric_eigen3};

use crate::linear_algebra::{Symmetric3, rows};
use crate::moments::{Fit, Moments};

/// Units of length per metre: 2^20, so that a unit is about a micrometre.
const UNITS: f64 = 1_048_576.0;
/// Units of weight per weight of 1: 2^12.
const WEIGHT_UNITS: f64 = 4096.0;

/// Moment sums in the world as integers, so that what was added can be subtracted again exactly, in any
/// order, anywhere.
///
/// With coordinates up to 2^15 m (35 bits), weights of 2^12 and up to 2^40 readings, a sum of squares stays
/// below 2^122, and four of them within 128 bits, also where rounding or damage makes each 2 bits larger. So many
/// are the readings of a time-of-flight camera of 1280x720 that stands before a wall for two days and nights at 5
/// key frames a second. Moving the origin of integer sums is exact, so no precision is lost far from the world's
/// origin.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(super) struct FixedMoments {
    weight: i128,
    first: [i128; 3],
    /// xx, xy, xz, yy, yz, zz.
    second: [i128; 6],
    /// Sum of weighted normals towards the cameras, which tells the side that was seen.
    facing: [i128; 3],
}

/// Half side of the cube within which moments are exact, metres.
pub(super) const REACH: f64 = 32_768.0;

/// Limit of the sum of weights, units.
const MOST_WEIGHT: u128 = 1 << 52;

/// Index pairs of `second`.
const PAIRS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

impl FixedMoments {
    /// From sums in the world and the normal towards the camera that saw them; `None` outside [`REACH`].
    pub(super) fn new(moments: &Moments, normal: [f64; 3]) -> Option<Self> {
        let centroid = moments.centroid();
        let spread = moments.covariance();
        let near = centroid.iter().all(|c| c.abs() < REACH) && spread.iter().all(|s| s.abs() < REACH * REACH);
        if !(near && moments.weight > 0.0 && moments.weight < 1e9) {
            return None;
        }
        let weight = ((moments.weight * WEIGHT_UNITS).round() as i128).max(1);
        let origin = centroid.map(|c| (c * UNITS).round() as i128);
        let second = std::array::from_fn(|i| {
            let (a, b) = PAIRS[i];
            let about_centroid = (spread[i] * UNITS * UNITS * weight as f64).round() as i128;
            about_centroid + weight * origin[a] * origin[b]
        });
        let facing = normal.map(|n| (n * UNITS).round() as i128 * weight);
        Some(Self { weight, first: origin.map(|o| o * weight), second, facing })
    }

    /// Whether the sums can come from points within [`REACH`], or are empty; sums of such sums can, too.
    pub(super) fn is_possible(&self) -> bool {
        let Some(weight) = u128::try_from(self.weight).ok().filter(|&weight| weight < MOST_WEIGHT) else {
            return false;
        };
        // Limits a bit above those of coordinates (35 bits), their products, and normals (20 bits), to allow
        // for rounding.
        let within = |sums: &[i128], bits: u32| sums.iter().all(|sum| sum.unsigned_abs() <= weight << bits);
        within(&self.first, 36) && within(&self.second, 72) && within(&self.facing, 22)
    }

    pub(super) fn add(&mut self, other: &Self) {
        self.combine(other, i128::wrapping_add);
    }

    pub(super) fn subtract(&mut self, other: &Self) {
        self.combine(other, i128::wrapping_sub);
    }

    fn combine(&mut self, other: &Self, operation: fn(i128, i128) -> i128) {
        self.weight = operation(self.weight, other.weight);
        for axis in 0..3 {
            self.first[axis] = operation(self.first[axis], other.first[axis]);
            self.facing[axis] = operation(self.facing[axis], other.facing[axis]);
        }
        for (sum, term) in self.second.iter_mut().zip(other.second) {
            *sum = operation(*sum, term);
        }
    }

    /// Whether sums of two sets of points can be added and leave half of all room to what comes with the
    /// least weight of all, a unit each: so much never comes. Whatever is added only where this holds, and
    /// else with that weight, stays [possible](Self::is_possible).
    pub(super) fn has_room_for(&self, other: &Self) -> bool {
        u128::try_from(self.weight.wrapping_add(other.weight)).is_ok_and(|weight| weight < MOST_WEIGHT / 2)
    }

    /// Sum of weights; a reading with the sensor's least noise (a Kinect's at 0.4 m) has weight 1.
    pub(super) fn weight(&self) -> f64 {
        self.weight as f64 / WEIGHT_UNITS
    }

    /// The sums about their centroid as floating point, and the centroid; `None` without points, and when
    /// others were subtracted than were added.
    pub(super) fn about_centroid(&self) -> Option<(Moments, [f64; 3])> {
        if self.weight <= 0 || !self.is_possible() {
            return None;
        }
        let weight = self.weight;
        let origin = self.first.map(|sum| sum.div_euclid(weight));
        let rest = std::array::from_fn::<_, 3, _>(|axis| self.first[axis] - weight * origin[axis]);
        let mean_rest = rest.map(|r| r as f64 / weight as f64);
        let second: [f64; 6] = std::array::from_fn(|i| {
            let (a, b) = PAIRS[i];
            let shifted = self.second[i] - origin[a] * self.first[b] - origin[b] * self.first[a]
                + weight * origin[a] * origin[b];
            (shifted as f64 - mean_rest[a] * mean_rest[b] * weight as f64) / (UNITS * UNITS * WEIGHT_UNITS)
        });
        let centroid = std::array::from_fn(|axis| (origin[axis] as f64 + mean_rest[axis]) / UNITS);
        Some((Moments { weight: self.weight(), first: [0.0; 3], second }, centroid))
    }

    /// Covariance of the points, square metres; 0 without points.
    pub(super) fn spread(&self) -> Symmetric3 {
        self.about_centroid().map_or([0.0; 6], |(moments, _)| moments.covariance())
    }

    /// The least-squares plane, its normal towards the cameras.
    pub(super) fn fit(&self) -> Option<Fit> {
        let (moments, centroid) = self.about_centroid()?;
        let SymmetricEigen3 { values, vectors, .. } = symmetric_eigen3(rows(&moments.covariance()))?;
        let (mse, normal) = (values[2].max(0.0), vectors[2]);
        let facing = self.facing.map(|f| f as f64);
        let away = dot(normal, facing) < 0.0;
        let normal = if away { normal.map(|n| -n) } else { normal };
        Some(Fit { centroid, normal, mse, depth_mse: mse })
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

    fn patch(centroid: [f64; 3], weight: f64) -> Moments {
        // A square of 1 m in x and y, 4 mm thick.
        Moments::from_covariance(weight, centroid, &[0.083, 0.0, 0.0, 0.083, 0.0, 1.6e-5])
    }

    #[test]
    fn far_from_the_origin_the_fit_is_as_good() {
        let up = [0.0, 0.0, 1.0];
        for place in [[0.0; 3], [30_000.0, -20_000.0, 12_345.678]] {
            let fit = FixedMoments::new(&patch(place, 500.0), up).unwrap().fit().unwrap();
            // The covariance itself was computed at this place in floating point before it was rounded.
            assert!((fit.normal[2] - 1.0).abs() < 1e-6, "{fit:?}");
            assert!((fit.centroid[0] - place[0]).abs() < 2e-6);
        }
        assert_eq!(FixedMoments::new(&patch([40_000.0, 0.0, 0.0], 1.0), [0.0, 0.0, 1.0]), None);
    }

    /// Damaged sums once overflowed here, or gave a plane farther away than its numbers can express.
    #[test]
    fn of_sums_that_no_points_in_reach_have_there_is_no_fit() {
        let right = FixedMoments::new(&patch([1.0, 2.0, 3.0], 500.0), [0.0, 0.0, 1.0]).unwrap();
        assert!(right.is_possible() && FixedMoments::default().is_possible());
        let mut far = right;
        far.first[1] = 1 << 123;
        let mut light = right;
        light.weight = 1;
        let mut thick = right;
        thick.second[0] = 1 << 123;
        let mut other = right;
        other.subtract(&FixedMoments::new(&patch([30_000.0; 3], 499.0), [0.0, 0.0, 1.0]).unwrap());
        for wrong in [far, light, thick, other] {
            assert!(!wrong.is_possible() && wrong.fit().is_none(), "{wrong:?}");
        }
    }

    /// Two days and nights before a wall, far from the world's origin.
    #[test]
    fn the_readings_of_days_have_a_fit() {
        let one = FixedMoments::new(&patch([30_000.0, 30_000.0, -30_000.0], 9.2e5), [0.0, 0.0, 1.0]).unwrap();
        let all = (0..19).fold(one, |sum, _| {
            let mut twice = sum;
            twice.add(&sum);
            twice
        });
        let fit = all.fit().unwrap();
        assert!((fit.normal[2] - 1.0).abs() < 1e-5 && (fit.centroid[2] + 30_000.0).abs() < 1e-5, "{fit:?}");
        let mut beyond = all;
        (0..2).for_each(|_| beyond.add(&beyond.clone()));
        assert!(!beyond.is_possible() && beyond.fit().is_none());
    }

    proptest! {
        #[test]
        fn taking_out_leaves_no_trace(
            places in prop::collection::vec(prop::array::uniform3(-1000.0..1000.0_f64), 2..6),
            weight in 1.0..1e5_f64,
        ) {
            let parts: Vec<_> =
                places.iter().map(|c| FixedMoments::new(&patch(*c, weight), [0.0, 0.0, -1.0]).unwrap()).collect();
            let mut all = FixedMoments::default();
            for part in &parts {
                all.add(part);
            }
            let mut without_first = all;
            without_first.subtract(&parts[0]);
            let mut others = FixedMoments::default();
            for part in parts[1..].iter().rev() {
                others.add(part);
            }
            prop_assert_eq!(without_first, others);
        }
    }
}
