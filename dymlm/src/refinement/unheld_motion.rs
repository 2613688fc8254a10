use dymlm_core::vector3::{Vector3, unit};
use dymlm_core::{FrameId, Pose, symmetric_eigen3};

use super::odometry_drift::Drift;

/// Where more than this share of odometry's variance is left, planes and objects say less than odometry
/// does.
const MOST_LEFT: f64 = 0.5;

/// A motion of a key frame of which planes, objects and loop closures say less than odometry: it is
/// about as well known as the caller's poses are.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct UnheldMotion {
    /// The key frame.
    pub frame: FrameId,
    /// Whether the key frame moves along the axis or turns about it.
    pub kind: MotionKind,
    /// Unit vector, world.
    pub axis: [f64; 3],
    /// Standard deviation relative to the first key frame, metres or radians, if the errors in the config are
    /// right.
    pub deviation: f64,
}

/// How something may move along an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum MotionKind {
    /// Along it.
    Translation,
    /// About it.
    Rotation,
}

/// The motions of a key frame that are unheld. `covariance`: of three rotations and three translations in the
/// camera's axes; `drift`: the covariance by odometry alone.
pub(super) fn unheld_motions(
    frame: FrameId,
    pose: &Pose,
    covariance: &[[f64; 6]; 6],
    drift: &Drift,
) -> Vec<UnheldMotion> {
    let part = |first: usize| -> [[f64; 3]; 3] {
        std::array::from_fn(|row| std::array::from_fn(|column| covariance[first + row][first + column]))
    };
    let rotation =
        [0, 1, 2].map(|row| [0, 1, 2].map(|column| if row == column { drift.rotation } else { 0.0 }));
    let parts =
        [(MotionKind::Translation, part(3), drift.translation), (MotionKind::Rotation, part(0), rotation)];
    let unheld = parts.into_iter().flat_map(|(kind, refined, by_odometry)| {
        let axes = left_of(&turned(&refined, pose), &by_odometry).unwrap_or_default();
        axes.into_iter().map(move |(axis, deviation)| UnheldMotion { frame, kind, axis, deviation })
    });
    unheld.collect()
}

/// The axes along which more than the allowed share of the variance is left, with the standard deviations
/// left.
fn left_of(refined: &[[f64; 3]; 3], by_odometry: &[[f64; 3]; 3]) -> Option<Vec<(Vector3, f64)>> {
    // Eigenvectors u of L^-1 R L^-T with O = L L^T: R L^-T u = share * L u.
    let root = lower_root(by_odometry)?;
    let columns = [0, 1, 2].map(|column| forward(&root, [0, 1, 2].map(|row| refined[row][column])));
    // Then the rows of L^-1 R in the same way; the result is symmetric, so its rows are its columns.
    let whitened = [0, 1, 2].map(|row| forward(&root, [0, 1, 2].map(|column| columns[column][row])));
    let eigen = symmetric_eigen3(whitened)?;
    let axes = eigen.values.into_iter().zip(eigen.vectors).filter(|(share, _)| *share > MOST_LEFT);
    let axes = axes.filter_map(|(share, vector)| {
        let motion: Vector3 = std::array::from_fn(|row| (0..=row).map(|k| root[row][k] * vector[k]).sum());
        let length = motion.iter().map(|c| c * c).sum::<f64>().sqrt();
        Some((unit(motion)?, share.sqrt() * length))
    });
    Some(axes.collect())
}

/// The lower triangular root L of a matrix L L^T; `None` when it is not positive definite.
fn lower_root(matrix: &[[f64; 3]; 3]) -> Option<[[f64; 3]; 3]> {
    let mut root = [[0.0; 3]; 3];
    for row in 0..3 {
        for column in 0..=row {
            let known: f64 = (0..column).map(|k| root[row][k] * root[column][k]).sum();
            let rest = matrix[row][column] - known;
            root[row][column] = if row == column { rest.sqrt() } else { rest / root[column][column] };
        }
        if root[row][row].is_nan() || root[row][row] <= 0.0 {
            return None;
        }
    }
    Some(root)
}

/// Solves L x = right.
fn forward(root: &[[f64; 3]; 3], right: Vector3) -> Vector3 {
    let mut x = [0.0; 3];
    for row in 0..3 {
        let known: f64 = (0..row).map(|k| root[row][k] * x[k]).sum();
        x[row] = (right[row] - known) / root[row][row];
    }
    x
}

/// Turns a covariance from the camera's axes to those of the world.
fn turned(covariance: &[[f64; 3]; 3], pose: &Pose) -> [[f64; 3]; 3] {
    // R C R^T: each column turned, then each row.
    let columns = [0, 1, 2].map(|column| pose.rotate([0, 1, 2].map(|row| covariance[row][column])));
    [0, 1, 2].map(|row| pose.rotate([0, 1, 2].map(|column| columns[column][row])))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Planes determine the position across a corridor better than odometry does, but not along it.
    #[test]
    fn what_is_along_a_corridor_is_unheld() {
        // The camera's axis z looks along the corridor, which is the world's axis x.
        let pose = Pose::new([0.0; 3], [0.5, 0.5, 0.5, 0.5]).unwrap();
        let mut covariance = [[0.0; 6]; 6];
        for (k, variance) in [1e-8, 1e-8, 1e-8, 1e-6, 1e-6, 0.0081].into_iter().enumerate() {
            covariance[k][k] = variance;
        }
        let ahead = pose.rotate([0.0, 0.0, 1.0]);
        let mut translation = [[0.0; 3]; 3];
        for row in 0..3 {
            for column in 0..3 {
                let own = if row == column { 0.04 } else { 0.0 };
                translation[row][column] = own + (0.01 - 0.04) * ahead[row] * ahead[column];
            }
        }
        let drift = Drift { translation, rotation: 1e-3 };
        let unheld = unheld_motions(FrameId::new(7), &pose, &covariance, &drift);
        let [motion] = unheld[..] else { panic!("{unheld:?}") };
        assert!(motion.frame == FrameId::new(7) && motion.kind == MotionKind::Translation);
        let along: f64 = motion.axis.iter().zip(ahead).map(|(a, b)| a * b).sum();
        assert!(along.abs() > 1.0 - 1e-12 && (motion.deviation - 0.09).abs() < 1e-12, "{motion:?}");
        // Nothing is unheld where planes determine everything, nor where there is no drift.
        covariance[5][5] = 1e-6;
        assert!(unheld_motions(FrameId::new(7), &pose, &covariance, &drift).is_empty());
        let none = Drift { translation: [[0.0; 3]; 3], rotation: 0.0 };
        assert!(unheld_motions(FrameId::new(7), &pose, &covariance, &none).is_empty());
    }
}
