use dymlm_core::{ConfigError, PinholeCamera, Pose, SplitMix64, check_range};
use dymlm_geometry::rigid_alignment;

use super::observation::PoseObservation;
use super::p3p::p3p;
use super::refine::{PoseRefiner, RobustKernel};
use crate::Error;

/// Largest number of samples: enough to find one without outliers when 28 % of the pairs are right.
const MOST_SAMPLES: usize = 300;
/// Probability that at least one sample is free of outliers when the search stops early.
const CONFIDENCE: f64 = 0.999;
/// Least number of pairs that must agree: three always do, and a fourth may by chance.
const LEAST_INLIERS: usize = 5;

/// Settings of [`PoseRansac`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct RansacConfig {
    /// Largest distance of an inlier from its partner in space, metres, 1e-6..=100, default 0.02.
    pub max_distance: f64,
    /// Largest distance of an inlier from its pixel, pixels, 0.01..=1000, default 2.
    pub max_pixels: f64,
    /// Seed of the samples. Default 7.
    pub seed: u64,
}

impl Default for RansacConfig {
    fn default() -> Self {
        Self { max_distance: 0.02, max_pixels: 2.0, seed: 7 }
    }
}

impl RansacConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("ransac.max_distance", self.max_distance, 1e-6..=100.0)?;
        check_range("ransac.max_pixels", self.max_pixels, 0.01..=1000.0)
    }
}

/// Finds the pose that most pairs agree on, whatever the errors of the other pairs.
///
/// Fischler, Bolles: "Random Sample Consensus", CACM 1981, with the truncated cost of Torr, Zisserman 2000
/// (MSAC), an adaptive number of samples, and a final fit to all inliers. Seeded: the same pairs give the
/// same pose. O(samples x pairs).
///
/// ```
/// use dymlm_core::Pose;
/// use dymlm_tracking::{PoseRansac, RansacConfig};
///
/// let a_from_b = Pose::new([1.0, 0.0, 0.5], [0.0, 0.6, 0.0, 0.8])?;
/// let in_b: Vec<[f64; 3]> = (0..30).map(|i| [f64::from(i % 5), f64::from(i / 5), f64::from(i * i % 7)]).collect();
/// let mut in_a: Vec<[f64; 3]> = in_b.iter().map(|&point| a_from_b.transform_point(point)).collect();
/// in_a.iter_mut().step_by(3).for_each(|point| point[1] += 0.7);
/// let found = PoseRansac::new(&RansacConfig::default())?.align(&in_b, &in_a).ok_or("20 pairs agree")?;
/// assert_eq!(found.inliers.len(), 20);
/// assert!(found.pose.distance(&a_from_b) < 1e-9);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct PoseRansac {
    config: RansacConfig,
    refiner: PoseRefiner,
}

/// A pose and the pairs that agree on it.
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct PoseConsensus {
    /// The pose, fitted to all inliers.
    pub pose: Pose,
    /// Indices of the pairs that agree with the pose, ascending.
    pub inliers: Vec<usize>,
    /// Number of samples tried.
    pub samples: usize,
}

impl PoseRansac {
    /// Checks the settings.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(config: &RansacConfig) -> Result<Self, Error> {
        config.validate()?;
        Ok(Self { config: config.clone(), refiner: PoseRefiner::new(RobustKernel::Huber(1.345))? })
    }

    /// The motion `a_from_b` between points in space, by Umeyama's fit to samples of three pairs. `None` when
    /// too few pairs agree. Points that are not finite are never inliers.
    pub fn align(&self, in_b: &[[f64; 3]], in_a: &[[f64; 3]]) -> Option<PoseConsensus> {
        let error = |pose: &Pose, i: usize| {
            let [p, q] = [pose.transform_point(in_b[i]), in_a[i]];
            let squared: f64 = p.iter().zip(q).map(|(p, q)| (p - q) * (p - q)).sum();
            squared / (self.config.max_distance * self.config.max_distance)
        };
        let propose = |sample: [usize; 3], poses: &mut Vec<Pose>| {
            poses.extend(rigid_alignment(&sample.map(|i| in_b[i]), &sample.map(|i| in_a[i])));
        };
        let fit = |pose: &Pose, inliers: &[usize]| {
            let [b, a] = [in_b, in_a].map(|points| inliers.iter().map(|&i| points[i]).collect::<Vec<_>>());
            rigid_alignment(&b, &a).unwrap_or(*pose)
        };
        self.search(in_b.len().min(in_a.len()), propose, error, fit)
    }

    /// The pose `camera_from_body` at which points of a body project to pixels, by P3P on samples of three,
    /// refined by Gauss-Newton. `None` when too few points agree. Points that are not finite are never
    /// inliers.
    pub fn pnp(
        &self,
        camera: &PinholeCamera,
        points: &[[f64; 3]],
        pixels: &[[f64; 2]],
    ) -> Option<PoseConsensus> {
        let error = |pose: &Pose, i: usize| {
            let Some([u, v]) = camera.project(pose.transform_point(points[i])) else { return f64::INFINITY };
            let [du, dv] = [u - pixels[i][0], v - pixels[i][1]];
            (du * du + dv * dv) / (self.config.max_pixels * self.config.max_pixels)
        };
        let propose = |sample: [usize; 3], poses: &mut Vec<Pose>| {
            let directions = sample.map(|i| camera.back_project(pixels[i], 1.0));
            poses.extend(p3p(&directions, &sample.map(|i| points[i])));
        };
        let fit = |pose: &Pose, inliers: &[usize]| {
            let sigma = 0.5 * self.config.max_pixels;
            let seen = |&i: &usize| PoseObservation::Pixel { point: points[i], pixel: pixels[i], sigma };
            let seen: Vec<_> = inliers.iter().map(seen).collect();
            self.refiner.refine(camera, pose, &seen).map_or(*pose, |refined| refined.camera_from_body)
        };
        self.search(points.len().min(pixels.len()), propose, error, fit)
    }

    /// `error` is the squared distance of a pair, relative to the largest one allowed for an inlier.
    fn search(
        &self,
        count: usize,
        propose: impl Fn([usize; 3], &mut Vec<Pose>),
        error: impl Fn(&Pose, usize) -> f64,
        fit: impl Fn(&Pose, &[usize]) -> Pose,
    ) -> Option<PoseConsensus> {
        if count < LEAST_INLIERS {
            return None;
        }
        let mut rng = SplitMix64::new(self.config.seed);
        let mut best: Option<(f64, Pose)> = None;
        let mut poses = Vec::with_capacity(4);
        let (mut samples, mut needed) = (0, MOST_SAMPLES);
        while samples < needed {
            samples += 1;
            poses.clear();
            propose(draw_three(&mut rng, count), &mut poses);
            for pose in &poses {
                let (cost, inliers) = judge(pose, count, &error);
                if best.is_none_or(|(lowest, _)| cost < lowest) {
                    best = Some((cost, *pose));
                    needed = needed.min(Self::samples_needed(inliers as f64 / count as f64));
                }
            }
        }
        let (mut cost, mut pose) = best?;
        // Two rounds, since a better pose has more inliers.
        for _ in 0..2 {
            let refined = fit(&pose, &inliers_of(&pose, count, &error));
            let (refined_cost, _) = judge(&refined, count, &error);
            if refined_cost <= cost {
                (cost, pose) = (refined_cost, refined);
            }
        }
        let inliers = inliers_of(&pose, count, &error);
        (inliers.len() >= LEAST_INLIERS).then_some(PoseConsensus { pose, inliers, samples })
    }

    fn samples_needed(inlier_share: f64) -> usize {
        let all_good = inlier_share.powi(3);
        if all_good >= 1.0 - 1e-9 {
            return 1;
        }
        // `ln_1p`, since without inliers ln(1 - all_good) is +0 and the quotient would be minus infinity.
        let needed = (1.0 - CONFIDENCE).ln() / (-all_good).ln_1p();
        if needed > 0.0 { needed.ceil() as usize } else { usize::MAX }
    }
}

fn draw_three(rng: &mut SplitMix64, count: usize) -> [usize; 3] {
    let first = rng.below(count);
    let mut second = rng.below(count - 1);
    second += usize::from(second >= first);
    let mut third = rng.below(count - 2);
    for taken in [first.min(second), first.max(second)] {
        third += usize::from(third >= taken);
    }
    [first, second, third]
}

/// The truncated cost of a pose, and its number of inliers. A NaN error is not an inlier.
fn judge(pose: &Pose, count: usize, error: impl Fn(&Pose, usize) -> f64) -> (f64, usize) {
    let (mut cost, mut inliers) = (0.0, 0);
    for i in 0..count {
        let squared = error(pose, i);
        if squared <= 1.0 {
            cost += squared;
            inliers += 1;
        } else {
            cost += 1.0;
        }
    }
    (cost, inliers)
}

fn inliers_of(pose: &Pose, count: usize, error: impl Fn(&Pose, usize) -> f64) -> Vec<usize> {
    (0..count).filter(|&i| error(pose, i) <= 1.0).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_three_different_pairs_and_all_are_drawn() {
        let mut rng = SplitMix64::new(1);
        let mut seen = std::collections::BTreeSet::new();
        for _ in 0..600 {
            let mut sample = draw_three(&mut rng, 5);
            sample.sort_unstable();
            assert!(sample[0] < sample[1] && sample[1] < sample[2] && sample[2] < 5);
            seen.insert(sample);
        }
        assert_eq!(seen.len(), 10);
    }
}
