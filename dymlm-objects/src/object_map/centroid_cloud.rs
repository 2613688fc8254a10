use dymlm_core::Pose;
use dymlm_core::vector3::{Vector3, difference};

#[cfg(feature = "state")]
use super::counter::MOST_COUNTED;
use super::counter::counted;

/// The centroids of an object's observations: their number, mean and spread (paper IV-B, the centroid cluster
/// C).
///
/// Running sums (Welford 1962) over three axes.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct CentroidCloud {
    count: u32,
    mean: Vector3,
    /// Sums of products of differences from the mean: xx, xy, xz, yy, yz, zz.
    products: [f64; 6],
}

/// Index pairs of the products.
const PAIRS: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];

impl CentroidCloud {
    /// Whether its numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        self.count <= MOST_COUNTED && self.mean.iter().chain(&self.products).all(|c| c.abs() < 1e100)
    }

    /// Adds the centroid of an observation; a centroid that is not finite is ignored.
    pub fn add(&mut self, centroid: [f64; 3]) {
        if !centroid.iter().all(|c| c.is_finite()) {
            return;
        }
        self.count = counted(self.count, 1);
        let before = difference(centroid, self.mean);
        for (mean, step) in self.mean.iter_mut().zip(before) {
            *mean += step / f64::from(self.count);
        }
        let after = difference(centroid, self.mean);
        for (product, (i, j)) in self.products.iter_mut().zip(PAIRS) {
            *product += before[i] * after[j];
        }
    }

    /// Adds another cloud (Chan, Golub and `LeVeque`, 1979).
    pub(crate) fn merge(&mut self, other: &Self) {
        let count = counted(self.count, other.count);
        if count == 0 {
            return;
        }
        let apart = difference(other.mean, self.mean);
        let share = f64::from(other.count) / f64::from(count);
        let factor = f64::from(self.count) * share;
        for ((product, added), (i, j)) in self.products.iter_mut().zip(other.products).zip(PAIRS) {
            *product += added + factor * apart[i] * apart[j];
        }
        for (mean, apart) in self.mean.iter_mut().zip(apart) {
            *mean += share * apart;
        }
        self.count = count;
    }

    /// The same centroids, moved.
    pub(crate) fn moved(&self, new_from_old: &Pose) -> Self {
        let rotation = new_from_old.rotation_matrix();
        let [xx, xy, xz, yy, yz, zz] = self.products;
        let full = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let turned = |i: usize, j: usize| {
            let terms = (0..3).flat_map(|k| (0..3).map(move |l| (k, l)));
            terms.map(|(k, l)| rotation[i][k] * full[k][l] * rotation[j][l]).sum()
        };
        let mean = if self.count == 0 { self.mean } else { new_from_old.transform_point(self.mean) };
        Self { count: self.count, mean, products: PAIRS.map(|(i, j)| turned(i, j)) }
    }

    /// Number of centroids.
    pub fn count(&self) -> u32 {
        self.count
    }

    /// Their mean, metres; the origin when there are none.
    pub fn mean(&self) -> [f64; 3] {
        self.mean
    }

    /// Their sample covariance (with divisor n - 1), square metres; `None` for fewer than two centroids.
    pub fn covariance(&self) -> Option<[[f64; 3]; 3]> {
        let degrees = f64::from(self.count.checked_sub(1).filter(|&degrees| degrees > 0)?);
        let [xx, xy, xz, yy, yz, zz] = self.products.map(|product| product / degrees);
        Some([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sums_do_not_depend_on_how_they_are_split() {
        let places: Vec<[f64; 3]> =
            (0..9).map(|k| [f64::from(k % 4), f64::from(k * k % 7), 1e6 + 0.1 * f64::from(k)]).collect();
        let cloud = |places: &[[f64; 3]]| {
            let mut cloud = CentroidCloud::default();
            for &place in places {
                cloud.add(place);
            }
            cloud
        };
        let all = cloud(&places);
        let mut parts = cloud(&places[..4]);
        parts.merge(&cloud(&places[4..]));
        let (one, other) = (all.covariance().unwrap(), parts.covariance().unwrap());
        for (one, other) in one.as_flattened().iter().zip(other.as_flattened()) {
            assert!((one - other).abs() < 1e-9, "{one} {other}");
        }
        assert_eq!(parts.count(), 9);
        // numpy.var([0,1,2,3,0,1,2,3,0], ddof=1).
        assert!((one[0][0] - 1.5).abs() < 1e-12, "{}", one[0][0]);
    }

    #[test]
    fn one_place_has_no_spread() {
        let mut cloud = CentroidCloud::default();
        cloud.add([f64::NAN, 0.0, 0.0]);
        assert_eq!(cloud.count(), 0);
        cloud.add([1.0, 2.0, 3.0]);
        assert_eq!((cloud.mean(), cloud.covariance()), ([1.0, 2.0, 3.0], None));
    }
}
