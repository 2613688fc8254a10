use dymlm_core::Pose;
use dymlm_core::vector3::{along, any_across, cross, difference, dot, norm, unit};
use dymlm_geometry::rigid_alignment;

/// Distance of estimated poses from the true ones.
///
/// The absolute trajectory error of Sturm et al. ("A Benchmark for the Evaluation of RGB-D SLAM Systems",
/// IROS 2012). A trajectory's place in the world is arbitrary, so the estimate is first aligned with the
/// truth by the rigid motion that fits positions best; of several, as for positions on a line, the nearest
/// one to that which fits attitudes best. Attitudes are compared after the rotation that fits attitudes best,
/// since the positions of a camera at rest do not fix it.
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
        let positions = |poses: &[Pose]| poses.iter().map(Pose::translation).collect::<Vec<_>>();
        let (from, to) = (positions(estimated), positions(truth));
        let by_attitudes = onto_mean(&attitude_alignment(estimated, truth)?, mean(&from), mean(&to))?;
        let by_positions = rigid_alignment(&from, &to)
            .or_else(|| line_alignment(&from, &to, &by_attitudes))
            .unwrap_or(by_attitudes);
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

/// The rotation that fits attitudes best. `None` without poses.
fn attitude_alignment(estimated: &[Pose], truth: &[Pose]) -> Option<Pose> {
    const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    // Each axis in both directions, so that their mean is the origin.
    let axes = |poses: &[Pose]| -> Vec<[f64; 3]> {
        let ends = poses.iter().flat_map(|pose| AXES.map(|axis| pose.rotate(axis)));
        ends.flat_map(|end| [end, end.map(|x| -x)]).collect()
    };
    rigid_alignment(&axes(estimated), &axes(truth))
}

/// The motion with this rotation that takes one mean position to the other.
fn onto_mean(rotation: &Pose, from: [f64; 3], to: [f64; 3]) -> Option<Pose> {
    Pose::new(difference(to, rotation.rotate(from)), rotation.quaternion()).ok()
}

/// The rigid motion that fits positions best where one of the two lists is on a line, which leaves the turn
/// about the line open: the nearest to `guess`. `None` where one of the lists is at one place.
fn line_alignment(from: &[[f64; 3]], to: &[[f64; 3]], guess: &Pose) -> Option<Pose> {
    let (from_mean, to_mean) = (mean(from), mean(to));
    // Their covariance is of rank 1: its rows are along the one line, its columns along the other.
    let mut covariance = [[0.0; 3]; 3];
    for (one, other) in from.iter().zip(to) {
        let (one, other) = (difference(*one, from_mean), difference(*other, to_mean));
        (0..3).for_each(|row| covariance[row] = along(covariance[row], other[row], one));
    }
    let longest = |rows: [[f64; 3]; 3]| rows.into_iter().max_by(|a, b| norm(*a).total_cmp(&norm(*b)));
    let from_line = unit(longest(covariance)?)?;
    let to_line = unit(covariance.map(|row| dot(row, from_line)))?;
    let turned = guess.rotate(from_line);
    // A quaternion holds half the angle between the lines: that to the line midway between them.
    let midway = unit(along(turned, 1.0, to_line)).unwrap_or_else(|| any_across(turned));
    let axis = cross(turned, midway);
    let turn = Pose::new([0.0; 3], [axis[0], axis[1], axis[2], dot(turned, midway)]).ok()? * *guess;
    onto_mean(&turn, from_mean, to_mean)
}

fn mean(positions: &[[f64; 3]]) -> [f64; 3] {
    let share = 1.0 / positions.len() as f64;
    positions.iter().fold([0.0; 3], |mean, position| along(mean, share, *position))
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

    /// Regression: attitudes that are off turned them.
    #[test]
    fn exact_positions_on_a_line_have_no_error() {
        for angle in [0.1, 3.0] {
            let (sin, cos) = (0.5_f64 * angle).sin_cos();
            let truth =
                [0.0, 1.0, 2.0, 5.0].map(|x| Pose::new([x, 2.0 * x, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap());
            let turned = truth.map(|pose| Pose::new(pose.translation(), [sin, 0.0, 0.0, cos]).unwrap());
            let score = TrajectoryScore::of(&turned, &truth).unwrap();
            assert!(score.translation < 1e-9 && score.rotation < 1e-6, "{score:?}");
            // On one side of a line that the truth keeps: the mean is all that can be moved.
            let bent = [(0, 0.0), (1, 0.1), (2, 0.1), (3, 0.0)].map(|(index, beside)| {
                let pose: &Pose = &turned[index];
                let [x, y, _] = pose.translation();
                Pose::new([x, y, beside], pose.quaternion()).unwrap()
            });
            let score = TrajectoryScore::of(&bent, &truth).unwrap();
            assert!(score.translation < 0.051, "{score:?}");
        }
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
