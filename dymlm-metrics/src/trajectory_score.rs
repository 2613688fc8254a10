use dymlm_core::Pose;
use dymlm_geometry::rigid_alignment;

/// How far estimated poses are from the true ones, frame by frame.
///
/// The absolute trajectory error of Sturm et al. ("A Benchmark for the Evaluation of RGB-D SLAM Systems", IROS
/// 2012): where a trajectory stands in the world is free, so that the estimated one is first put onto the true
/// one by the best rigid motion.
///
/// ```
/// use dymlm_core::Pose;
/// use dymlm_metrics::TrajectoryScore;
///
/// let at = |x: f64, y: f64| Pose::new([x, y, 0.0], [0.0, 0.0, 0.0, 1.0]);
/// let truth = [at(0.0, 0.0)?, at(1.0, 0.0)?, at(1.0, 1.0)?, at(0.0, 1.0)?];
/// let elsewhere = truth.map(|pose| Pose::new([5.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]).map(|motion| motion * pose));
/// let elsewhere: Vec<Pose> = elsewhere.into_iter().collect::<Result<_, _>>()?;
/// let score = TrajectoryScore::of(&elsewhere, &truth).ok_or("not on a line")?;
/// assert!(score.translation < 1e-9 && score.rotation < 1e-6);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct TrajectoryScore {
    /// Root mean square of the distances between positions, metres.
    pub translation: f64,
    /// Root mean square of the angles between attitudes, radians.
    pub rotation: f64,
}

impl TrajectoryScore {
    /// Of poses `world_from_camera`, pair by pair; those beyond the shorter list are passed over. `None` when
    /// there are fewer than three, or all true ones on a line: no rotation is best.
    pub fn of(estimated: &[Pose], truth: &[Pose]) -> Option<Self> {
        let positions = |poses: &[Pose]| poses.iter().map(Pose::translation).collect::<Vec<_>>();
        let true_from_estimated = rigid_alignment(&positions(estimated), &positions(truth))?;
        let aligned: Vec<Pose> = estimated.iter().map(|pose| true_from_estimated * *pose).collect();
        let mean_square = |error: fn(&Pose, &Pose) -> f64| {
            let squares = aligned.iter().zip(truth).map(|(one, other)| error(one, other).powi(2));
            (squares.sum::<f64>() / aligned.len().min(truth.len()) as f64).sqrt()
        };
        Some(Self { translation: mean_square(Pose::distance), rotation: mean_square(Pose::angle) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two of four positions are off by 2 mm each, to opposite sides: no rigid motion mends that.
    #[test]
    fn errors_are_root_mean_squares() {
        let at = |x: f64, y: f64, z: f64| Pose::new([x, y, z], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let truth = [at(1.0, 0.0, 0.0), at(-1.0, 0.0, 0.0), at(0.0, 1.0, 0.0), at(0.0, -1.0, 0.0)];
        let estimated =
            [at(1.0, 0.0, 0.002), at(-1.0, 0.0, 0.002), at(0.0, 1.0, -0.002), at(0.0, -1.0, -0.002)];
        let score = TrajectoryScore::of(&estimated, &truth).unwrap();
        assert!((score.translation - 0.002).abs() < 1e-12 && score.rotation < 1e-9);
        // Attitudes alone.
        let (sin, cos) = 0.05_f64.sin_cos();
        let turned = truth.map(|pose| Pose::new(pose.translation(), [0.0, 0.0, sin, cos]).unwrap());
        let score = TrajectoryScore::of(&turned, &truth).unwrap();
        assert!(score.translation < 1e-12 && (score.rotation - 0.1).abs() < 1e-9);
        assert_eq!(TrajectoryScore::of(&truth[..2], &truth), None);
        assert_eq!(TrajectoryScore::of(&[], &[]), None);
    }
}
