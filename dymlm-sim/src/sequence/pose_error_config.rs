use dymlm_core::{ConfigError, check_range};

/// The errors of the poses that a SLAM front end estimates. By default they are exact.
///
/// All errors act in the camera's frame, so that they do not depend on the world's origin. Random walks are
/// given by the root mean square of the whole translation or rotation (not of one axis) after one unit of
/// time or motion; after n units the root mean square is sqrt(n) times as large.
///
/// ```
/// use dymlm_sim::{PoseErrorConfig, Sequence, SequenceConfig};
///
/// let mut config = SequenceConfig::default();
/// config.pose_error = PoseErrorConfig::slam();
/// config.pose_error.loop_closure = Some(10.0);
/// let sequence = Sequence::new(&config)?;
/// let error = |index| sequence.estimated_pose(index).distance(&sequence.world_from_camera(index));
/// assert!(error(0) < 0.01 && error(99) > 0.01);
/// // At 10 s the loop closes.
/// assert_eq!(sequence.loop_closure_frame(), Some(100));
/// assert!(error(100) < error(99));
/// // The back end then corrects the earlier frames as well.
/// assert_eq!(sequence.corrected_poses(100).len(), 101);
/// assert_ne!(sequence.corrected_poses(100)[50], sequence.corrected_poses(99)[50]);
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct PoseErrorConfig {
    /// Drift of the position, metres after a second (m / sqrt(s)), 0..=10, default 0.
    pub translation_per_second: f64,
    /// Drift of the rotation, radians after a second (rad / sqrt(s)), 0..=1, default 0.
    pub rotation_per_second: f64,
    /// Further drift of the position by motion, metres after a metre moved (m / sqrt(m)), 0..=10, default 0.
    pub translation_per_metre: f64,
    /// Further drift of the rotation by motion, radians after a radian turned (sqrt(rad)), 0..=1, default 0.
    pub rotation_per_radian: f64,
    /// Time over which the drift keeps its direction, seconds, 0.01..=100, default 0.5: the drift's velocity
    /// is drawn anew at these intervals and linear in between, so that the error is a smooth function of
    /// time. (The time between frames when that is longer.)
    pub smoothness: f64,
    /// Error of the position of each frame alone, metres (root mean square of its length), 0..=1, default 0.
    pub translation_jitter: f64,
    /// Error of the rotation of each frame alone, radians (root mean square of its angle), 0..=1, default 0.
    pub rotation_jitter: f64,
    /// Time at which the back end closes a loop with the first frame, seconds, 0..=1e9, default `None`. The
    /// closure removes the whole drift and spreads the correction evenly over the frames so far, as
    /// pose-graph optimization does with equally certain odometry steps; later frames drift on from there.
    pub loop_closure: Option<f64>,
}

impl Default for PoseErrorConfig {
    fn default() -> Self {
        Self {
            translation_per_second: 0.0,
            rotation_per_second: 0.0,
            translation_per_metre: 0.0,
            rotation_per_radian: 0.0,
            smoothness: 0.5,
            translation_jitter: 0.0,
            rotation_jitter: 0.0,
            loop_closure: None,
        }
    }
}

impl PoseErrorConfig {
    /// RGB-D SLAM among walking people: a drift of 1 cm and 0.27 degrees after a second, and a jitter of 1 mm
    /// and 0.03 degrees.
    ///
    /// The drift is the relative pose error over a second (RMSE) that Yu et al. ("DS-SLAM", IROS 2018, tables
    /// II and III) report on TUM's `fr3_walking_static`: 0.0102 m and 0.269 degrees; with moving cameras they
    /// report two to three times as much. The jitter is an estimate.
    #[must_use]
    pub fn slam() -> Self {
        Self {
            translation_per_second: 0.0102,
            rotation_per_second: 0.269_f64.to_radians(),
            translation_jitter: 0.001,
            rotation_jitter: 0.03_f64.to_radians(),
            ..Self::default()
        }
    }

    /// Odometry whose position error is a `share` of the distance travelled (root mean square) after
    /// `metres`: visual odometry drifts by .01 to .05 of the distance. Rotation and jitter are those of
    /// [`slam`](Self::slam); the position error that follows from the rotation error comes on top.
    #[must_use]
    pub fn share_of_way(share: f64, metres: f64) -> Self {
        Self { translation_per_second: 0.0, translation_per_metre: share * metres.sqrt(), ..Self::slam() }
    }

    /// Whether estimated poses are exact.
    pub(super) fn is_exact(&self) -> bool {
        [
            self.translation_per_second,
            self.rotation_per_second,
            self.translation_per_metre,
            self.rotation_per_radian,
            self.translation_jitter,
            self.rotation_jitter,
        ]
        .iter()
        .all(|&rate| rate == 0.0)
    }

    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("pose_error.translation_per_second", self.translation_per_second, 0.0..=10.0)?;
        check_range("pose_error.rotation_per_second", self.rotation_per_second, 0.0..=1.0)?;
        check_range("pose_error.translation_per_metre", self.translation_per_metre, 0.0..=10.0)?;
        check_range("pose_error.rotation_per_radian", self.rotation_per_radian, 0.0..=1.0)?;
        check_range("pose_error.smoothness", self.smoothness, 0.01..=100.0)?;
        check_range("pose_error.translation_jitter", self.translation_jitter, 0.0..=1.0)?;
        check_range("pose_error.rotation_jitter", self.rotation_jitter, 0.0..=1.0)?;
        match self.loop_closure {
            Some(time) => check_range("pose_error.loop_closure", time, 0.0..=1e9),
            None => Ok(()),
        }
    }
}
