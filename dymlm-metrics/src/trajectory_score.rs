use dymlm_core::Pose;
use dymlm_core::vector3::{along, difference};
use dymlm_geometry::rigid_alignment;

/// Distance of estimated poses from the true ones.
///
/// The absolute trajectory error of Sturm et al. ("A Benchmark for the Evaluation of RGB-D SLAM Systems",
/// IROS 2012). A trajectory's place in the world is arbitrary, so the estimate is first aligned with the
/// truth by the rigid motion that fits positions best. Attitudes are compared after the rotation that fits
/// attitudes best, since the positions of a camera at rest do not fix it. That rotation also aligns positions
/// that lie on a line.
///
/// ```
/// use dymlm_core::Pose;
/// use dymlm_metrics::TrajectoryScore;
///
/// let at = |x: f64, y: f64| Pose::new([x, y, 0.0], [0.0, 0.0, 0.0, 1.0]);
/// let truth = [at(0.0, 0.0)?, at(1.0, 0.0)?, at(1.0, 1.0)?, at(0.0, 1.0)?];
/// let elsewhere = truth.map(|pose| Pose::new([5.0, 0.0, 0.0], [1.0, 0.0, 0.0, 0.0]).map(|motion| motion * pose));
/// let elsewhere: Vec<Pose> = elsewhere.into_iter().collect::<Result<_, _>>()?;
/// let score = TrajectoryScore::of(&elsewhere, &truth).ok_or("no poses")?;
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
    /// Scores poses `world_from_camera`, pair by pair; poses beyond the shorter list are ignored. `None` when
    /// there are no pairs.
    pub fn of(estimated: &[Pose], truth: &[Pose]) -> Option<Self> {
        let count = estimated.len().min(truth.len());
        let (estimated, truth) = (&estimated[..count], &truth[..count]);
        let by_attitudes = attitude_alignment(estimated, truth)?;
        let positions = |poses: &[Pose]| poses.iter().map(Pose::translation).collect::<Vec<_>>();
        let by_positions = rigid_alignment(&positions(estimated), &positions(truth)).unwrap_or(by_attitudes);
        let mean_square = |alignment: Pose, error: fn(&Pose, &Pose) -> f64| {
            let squares =
                estimated.iter().zip(truth).map(|(one, other)| error(&(alignment * *one), other).powi(2));
            (squares.sum::<f64>() / count as f64).sqrt()
        };
        Some(Self {
            translation: mean_square(by_positions, Pose::distance),
            rotation: mean_square(by_attitudes, Pose::angle),
        })
    }
}

/// The rotation that fits attitudes best, with the translation that then fits the mean position. `None`
/// without poses.
fn attitude_alignment(estimated: &[Pose], truth: &[Pose]) -> Option<Pose> {
    const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    // Each axis in both directions, so that their mean is the origin.
    let axes = |poses: &[Pose]| -> Vec<[f64; 3]> {
        let ends = poses.iter().flat_map(|pose| AXES.map(|axis| pose.rotate(axis)));
        ends.flat_map(|end| [end, end.map(|x| -x)]).collect()
    };
    let turn = rigid_alignment(&axes(estimated), &axes(truth))?;
    let mean = |poses: &[Pose]| {
        let share = 1.0 / poses.len() as f64;
        poses.iter().fold([0.0; 3], |mean, pose| along(mean, share, pose.translation()))
    };
    Pose::new(difference(mean(truth), turn.rotate(mean(estimated))), turn.quaternion()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Each of the four positions is off by 2 mm, two up and two down: no rigid motion reduces that.
    #[test]
    fn errors_are_root_mean_squares() {
        let at = |x: f64, y: f64, z: f64| Pose::new([x, y, z], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let truth = [at(1.0, 0.0, 0.0), at(-1.0, 0.0, 0.0), at(0.0, 1.0, 0.0), at(0.0, -1.0, 0.0)];
        let estimated =
            [at(1.0, 0.0, 0.002), at(-1.0, 0.0, 0.002), at(0.0, 1.0, -0.002), at(0.0, -1.0, -0.002)];
        let score = TrajectoryScore::of(&estimated, &truth).unwrap();
        assert!((score.translation - 0.002).abs() < 1e-12 && score.rotation < 1e-9);
        // Errors of attitude alone, half of them in each direction.
        let (sin, cos) = 0.05_f64.sin_cos();
        let mut side = sin;
        let turned = truth.map(|pose| {
            side = -side;
            Pose::new(pose.translation(), [0.0, 0.0, side, cos]).unwrap()
        });
        let score = TrajectoryScore::of(&turned, &truth).unwrap();
        assert!(score.translation < 1e-12 && (score.rotation - 0.1).abs() < 1e-9);
        assert_eq!(TrajectoryScore::of(&[], &truth), None);
    }

    /// When positions leave the rotation undetermined, attitudes determine it.
    #[test]
    fn cameras_that_stand_or_go_straight_are_scored() {
        let at = |x: f64, angle: f64| {
            let (sin, cos) = (0.5 * angle).sin_cos();
            Pose::new([x, 0.0, 0.0], [sin, 0.0, 0.0, cos]).unwrap()
        };
        let motion = Pose::new([3.0, 2.0, 1.0], [0.5, 0.5, 0.5, 0.5]).unwrap();
        for step in [0.0, 0.1] {
            let truth = [0, 1, 2, 3].map(|k| at(step * f64::from(k), 0.1 * f64::from(k)));
            let score = TrajectoryScore::of(&truth.map(|pose| motion * pose), &truth).unwrap();
            assert!(score.translation < 1e-9 && score.rotation < 1e-6, "{score:?}");
        }
    }
}
