use dymlm_core::symmetric_eigen3;
use dymlm_core::vector3::{difference, dot};

use crate::CentroidCloud;
use crate::quantiles::{fisher_f_quantile, student_t_quantile};

/// Tests whether a new centroid belongs to the cloud of an object's centroids.
///
/// ```
/// use dymlm_objects::{CentroidCloud, CentroidTest, CentroidVerdict};
///
/// let mut cloud = CentroidCloud::default();
/// for k in 0..30_i32 {
///     cloud.add([k * 7 % 10, k * k % 11, k * 3 % 7].map(|place| 0.002 * f64::from(place)));
/// }
/// let [near, far] = [[0.016, 0.008, 0.006], [0.1, 0.008, 0.006]];
/// assert_eq!(CentroidTest::Prediction.verdict(&cloud, near, 0.05), CentroidVerdict::Accepted);
/// assert_eq!(CentroidTest::Prediction.verdict(&cloud, far, 0.05), CentroidVerdict::Rejected);
/// // The paper's test asks for the mean itself, from which an ordinary observation is too far.
/// assert_eq!(CentroidTest::OneSampleT.verdict(&cloud, near, 0.05), CentroidVerdict::Rejected);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum CentroidTest {
    /// Hotelling's T^2 for one new observation: with m centroids of mean x and sample covariance S, T^2 = m /
    /// (m + 1) (c - x)^T S^-1 (c - x) is distributed as 3 (m - 1) / (m - 3) F(3, m - 3), so that a true
    /// observation is rejected with probability alpha. Needs m >= 4.
    ///
    /// Hotelling: "The Generalization of Student's Ratio", Annals of Mathematical Statistics 1931.
    #[default]
    Prediction,
    /// The paper's eq. 9 to 12: |t| <= `t_{alpha/2, m-1}` on each axis, with t = (x - c) / (sigma / sqrt m).
    /// It tests whether c is the *mean* of the cloud, and so rejects nearly every true observation once m is
    /// large. Needs m >= 2.
    OneSampleT,
}

/// Result of a centroid test.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
pub enum CentroidVerdict {
    /// The centroid may be the object's.
    Accepted,
    /// The centroid is too far away.
    Rejected,
    /// There are too few centroids, or they have no spread.
    Undecided,
}

impl CentroidTest {
    /// Whether `centroid` belongs to the cloud; `alpha` is the probability with which a true observation is
    /// rejected.
    pub fn verdict(self, cloud: &CentroidCloud, centroid: [f64; 3], alpha: f64) -> CentroidVerdict {
        match self.limit(cloud.count(), alpha) {
            Some(limit) => self.verdict_at(cloud, centroid, limit),
            None => CentroidVerdict::Undecided,
        }
    }

    /// The greatest accepted T^2 or |t| for `count` centroids; `None` when they are too few.
    pub(super) fn limit(self, count: u32, alpha: f64) -> Option<f64> {
        let m = f64::from(count);
        match self {
            Self::Prediction => {
                let f = (count >= 4).then(|| fisher_f_quantile(1.0 - alpha, 3.0, m - 3.0))??;
                Some(3.0 * (m - 1.0) / (m - 3.0) * f)
            }
            Self::OneSampleT => (count >= 2).then(|| student_t_quantile(1.0 - 0.5 * alpha, m - 1.0))?,
        }
    }

    /// The verdict at a limit from [`limit`](Self::limit).
    pub(super) fn verdict_at(self, cloud: &CentroidCloud, centroid: [f64; 3], limit: f64) -> CentroidVerdict {
        let statistic = match self {
            Self::Prediction => hotelling(cloud, centroid),
            Self::OneSampleT => greatest_t(cloud, centroid),
        };
        match statistic {
            Some(statistic) if statistic <= limit => CentroidVerdict::Accepted,
            Some(_) => CentroidVerdict::Rejected,
            None => CentroidVerdict::Undecided,
        }
    }
}

/// T^2 of a new observation; `None` when the cloud has no spread in some direction.
fn hotelling(cloud: &CentroidCloud, centroid: [f64; 3]) -> Option<f64> {
    let spread = symmetric_eigen3(cloud.covariance()?)?;
    let least = spread.values[2];
    // A smaller variance is only rounding error.
    if least.is_nan() || least <= 1e-14 * spread.values[0] || least <= 0.0 {
        return None;
    }
    let offset = difference(centroid, cloud.mean());
    let squared: f64 = spread
        .vectors
        .iter()
        .zip(spread.values)
        .map(|(axis, variance)| dot(*axis, offset).powi(2) / variance)
        .sum();
    let m = f64::from(cloud.count());
    Some(m / (m + 1.0) * squared).filter(|squared| !squared.is_nan())
}

/// The greatest |t| of the three axes; `None` when the cloud has no spread on one of them.
fn greatest_t(cloud: &CentroidCloud, centroid: [f64; 3]) -> Option<f64> {
    let covariance = cloud.covariance()?;
    let offset = difference(cloud.mean(), centroid);
    let mut greatest = 0.0_f64;
    for axis in 0..3 {
        let error = (covariance[axis][axis] / f64::from(cloud.count())).sqrt();
        if error.is_nan() || error <= 0.0 || offset[axis].is_nan() {
            return None;
        }
        greatest = greatest.max(offset[axis].abs() / error);
    }
    Some(greatest)
}
