use dymlm::core::Pose;
use dymlm::{MultiLevelMap, PlaneMap};
use serde::Serialize;

use crate::AnyError;

/// Median, 95 % quantile and maximum of durations, milliseconds.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Milliseconds {
    /// Half of the durations are at most this.
    pub median_ms: f64,
    /// 95 % of the durations are at most this.
    pub p95_ms: f64,
    /// The longest.
    pub max_ms: f64,
}

impl Milliseconds {
    /// Computes these from durations in milliseconds; all zero when there are none.
    pub fn of(mut durations: Vec<f64>) -> Self {
        durations.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let rank = (durations.len() as f64 * share).ceil() as usize;
            durations.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
        };
        Self { median_ms: quantile(0.5), p95_ms: quantile(0.95), max_ms: quantile(1.0) }
    }
}

/// The mean "up" direction of the images at these poses, in the world: for pictures, when up is not given.
/// People hold cameras upright on average.
pub fn mean_up(poses: impl Iterator<Item = Pose>) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for pose in poses {
        let up = pose.rotate([0.0, -1.0, 0.0]);
        sum = std::array::from_fn(|axis| sum[axis] + up[axis]);
    }
    let length = sum.iter().map(|c| c * c).sum::<f64>().sqrt();
    if length > 1e-9 { sum.map(|c| c / length) } else { [0.0, 0.0, 1.0] }
}

/// The normal of the largest plane (floor, table) that is within 45 degrees of the approximate up direction
/// `about`; `about` itself when there is none.
pub fn up_of_planes(planes: &PlaneMap, about: [f64; 3]) -> [f64; 3] {
    let cosine = |normal: [f64; 3]| (0..3).map(|axis| normal[axis] * about[axis]).sum::<f64>();
    let level = planes.iter().filter(|plane| cosine(plane.plane().normal()) > 0.5_f64.sqrt());
    let largest = level.max_by(|a, b| a.area().total_cmp(&b.area()));
    largest.map_or(about, |plane| plane.plane().normal())
}

/// Up in a saved map: by its planes, about the direction that is given on the command line or else about the
/// one that the map knows.
///
/// # Errors
///
/// When neither is known: z need not be up, as in the worlds of cameras that look ahead.
pub fn up_of_map(map: &MultiLevelMap, given: Option<[f64; 3]>) -> Result<[f64; 3], AnyError> {
    let about = given.or_else(|| map.up());
    let about = about.ok_or("the map does not know what is up: give it, as --up 0 0 1 where z is up")?;
    Ok(up_of_planes(map.planes(), about))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_are_values_that_occurred() {
        let times = Milliseconds::of((1..=100).rev().map(f64::from).collect());
        assert_eq!(times, Milliseconds { median_ms: 50.0, p95_ms: 95.0, max_ms: 100.0 });
        assert_eq!(Milliseconds::of(Vec::new()), Milliseconds::default());
    }

    #[test]
    fn up_is_against_the_image_rows() {
        assert_eq!(mean_up([Pose::identity()].into_iter()), [0.0, -1.0, 0.0]);
        assert_eq!(mean_up(std::iter::empty()), [0.0, 0.0, 1.0]);
    }
}
