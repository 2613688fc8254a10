use dymlm_core::symmetric_eigen3;
use dymlm_core::vector3::{difference, dot};

use crate::linear_algebra::rows;
use crate::moments::{Fit, Moments};

/// Number of parts across a strip: enough to show a step in its middle, few enough for many readings in each.
const PARTS: usize = 8;
/// Largest root mean square distance of the parts' means from the plane, metres. Across a step of height h it
/// is h / 4. With 3 mm some frames of doors are missed, into which readings of the wall above have come; without
/// the rule a step of 3 cm at 3 m is a plane (`a_step_within_the_noise_yields_no_plane`).
const MAX_MISFIT: f64 = 0.004;

/// The shape of a strip across its longest extent: the mean distances of its parts from the plane.
///
/// A plane through the step between two surfaces is as flat as the noise, but along the step the noise
/// averages out: the means of its parts are above the plane on one side of the step and below it on the other.
#[derive(Debug, Clone)]
pub(super) struct StripProfile {
    fit: Fit,
    across: [f64; 3],
    /// Half of the strip's width, metres.
    half_width: f64,
    /// Sums of the distances, and numbers of readings.
    parts: [(f64, u32); PARTS],
}

impl StripProfile {
    /// The profile without readings; `None` unless the `sums` of all readings define the directions.
    pub(super) fn new(sums: &Moments) -> Option<Self> {
        let (fit, axes) = (sums.fit()?, symmetric_eigen3(rows(&sums.covariance()))?);
        // Readings spread evenly over a width w have the deviation w / sqrt(12).
        let half_width = (3.0 * axes.values[1].max(0.0)).sqrt();
        let parts = [(0.0, 0); PARTS];
        (half_width > 0.0).then_some(Self { fit, across: axes.vectors[1], half_width, parts })
    }

    /// Adds a reading.
    pub(super) fn add(&mut self, point: [f64; 3]) {
        let offset = difference(point, self.fit.centroid);
        let place = 0.5 * (1.0 + dot(self.across, offset) / self.half_width);
        // What is beyond the width belongs to the outermost parts.
        let part = (place * PARTS as f64).clamp(0.0, (PARTS - 1) as f64) as usize;
        self.parts[part].0 += dot(self.fit.normal, offset);
        self.parts[part].1 += 1;
    }

    /// Whether the parts' means lie off the plane.
    pub(super) fn is_step(&self) -> bool {
        let of_parts = self.parts.iter().filter(|(_, readings)| *readings > 0);
        let squares: f64 = of_parts.map(|(sum, readings)| sum * sum / f64::from(*readings)).sum();
        let readings: u32 = self.parts.iter().map(|(_, readings)| readings).sum();
        squares > MAX_MISFIT * MAX_MISFIT * f64::from(readings)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The profile of a strip of 10 cm before the camera, with a height for each place across it.
    fn is_step(height: impl Fn(f64) -> f64) -> bool {
        let (mut sums, mut points) = (Moments::default(), Vec::new());
        for along in 0..40 {
            for across in 0..20 {
                let x = 0.005 * (f64::from(across) - 9.5);
                points.push([x, 0.02 * f64::from(along), 2.0 + height(x)]);
            }
        }
        for &point in &points {
            sums.add_point(point, 1.0);
        }
        let mut profile = StripProfile::new(&sums).unwrap();
        for point in points {
            profile.add(point);
        }
        profile.is_step()
    }

    #[test]
    fn a_strip_across_a_step_is_told_from_a_plane() {
        assert!(!is_step(|_| 0.0) && !is_step(|x| 2.0 * x));
        assert!(is_step(|x| if x > 0.0 { 0.03 } else { 0.0 }));
        assert!(!is_step(|x| if x > 0.0 { 0.005 } else { 0.0 }));
    }

    #[test]
    fn points_on_a_line_have_no_profile() {
        let mut sums = Moments::default();
        for k in 0..9 {
            sums.add_point([0.1 * f64::from(k), 0.0, 2.0], 1.0);
        }
        assert!(StripProfile::new(&sums).is_none() && StripProfile::new(&Moments::default()).is_none());
    }
}
