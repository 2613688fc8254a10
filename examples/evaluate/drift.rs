use std::path::Path;

use clap::Args;
use dymlm::core::Pose;
use dymlm_examples::AnyError;
use dymlm_sim::{PoseErrorConfig, RecordedDrift, Sequence};
use serde::Serialize;

use crate::subjects::Subject;

/// Source of the poses that the maps are built with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(crate) enum Poses {
    /// They are the true ones.
    True,
    /// They drift, and the maps stay as they are.
    Drifting,
    /// They drift; after the last frame, the maps are corrected to the true poses.
    Corrected,
    /// They drift; after the last frame, they are refined by planes and objects.
    Refined,
}

impl Poses {
    /// Name in tables.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::True => "true poses",
            Self::Drifting => "drifting",
            Self::Corrected => "corrected",
            Self::Refined => "refined",
        }
    }
}

/// How poses drift.
#[derive(Args)]
pub(crate) struct DriftArguments {
    /// Poses drift like those of a SLAM
    #[arg(long, group = "drift")]
    pose_noise: bool,
    /// Positions drift by this share of the distance travelled, 0.01 to 0.05, and rotations like those of a
    /// SLAM
    #[arg(long, value_name = "SHARE", group = "drift")]
    drift_share: Option<f64>,
    /// Poses drift like those of an odometry on a recorded path: one pose a line, x, y, z, qx, qy, qz, qw
    #[arg(long, value_name = "FILE", group = "drift", requires = "true_path")]
    recorded_drift: Option<std::path::PathBuf>,
    /// The true poses of that path, line by line
    #[arg(long, value_name = "FILE", requires = "recorded_drift")]
    true_path: Option<std::path::PathBuf>,
    /// With drift: maps each sequence with true poses, with drifting poses, and with drifting poses corrected
    /// to the true ones at the end, as by a perfect loop closure
    #[arg(long, requires = "drift")]
    correct: bool,
    /// With drift: maps each sequence with drifting poses, and with these poses refined by planes and objects
    /// at the end
    #[arg(long, requires = "drift", conflicts_with = "correct")]
    refine: bool,
}

/// How the poses of subjects drift.
enum Drift {
    Slam,
    /// By a share of the distance travelled.
    Share(f64),
    Recorded(RecordedDrift),
}

impl DriftArguments {
    /// The kinds of poses with which each sequence is mapped.
    pub(crate) fn poses(&self) -> &'static [Poses] {
        let drifts = self.pose_noise || self.drift_share.is_some() || self.recorded_drift.is_some();
        match (drifts, self.correct, self.refine) {
            (false, ..) => &[Poses::True],
            (true, false, false) => &[Poses::Drifting],
            (true, true, _) => &[Poses::True, Poses::Corrected],
            (true, false, true) => &[Poses::True, Poses::Refined],
        }
    }

    /// Makes the poses of the subjects drift.
    pub(crate) fn apply(&self, subjects: &mut [Subject]) -> Result<(), AnyError> {
        let Some(drift) = self.drift()? else { return Ok(()) };
        for subject in subjects {
            drift.apply(subject)?;
        }
        Ok(())
    }

    fn drift(&self) -> Result<Option<Drift>, AnyError> {
        if let (Some(estimated), Some(exact)) = (&self.recorded_drift, &self.true_path) {
            let recorded = RecordedDrift::new(&read_path(exact)?, &read_path(estimated)?);
            let recorded = recorded.ok_or("the recorded paths are not of one length, or have none")?;
            return Ok(Some(Drift::Recorded(recorded)));
        }
        Ok(self.drift_share.map(Drift::Share).or(self.pose_noise.then_some(Drift::Slam)))
    }
}

impl Drift {
    fn apply(&self, subject: &mut Subject) -> Result<(), AnyError> {
        let exact = true_poses(&subject.sequence);
        let way: f64 = exact.windows(2).map(|pair| pair[0].distance(&pair[1])).sum();
        let error = match self {
            Self::Recorded(drift) => {
                subject.drifting = drift.on_path(&exact);
                return Ok(());
            }
            Self::Slam => PoseErrorConfig::slam(),
            Self::Share(share) => PoseErrorConfig::share_of_way(*share, way),
        };
        let mut config = subject.sequence.config().clone();
        config.pose_error = error;
        subject.sequence = Sequence::new(&config)?;
        subject.drifting = (0..exact.len()).map(|index| subject.sequence.estimated_pose(index)).collect();
        Ok(())
    }
}

/// The true poses of the frames of a sequence.
pub(crate) fn true_poses(sequence: &Sequence) -> Vec<Pose> {
    (0..sequence.len()).map(|index| sequence.world_from_camera(index)).collect()
}

fn read_path(file: &Path) -> Result<Vec<Pose>, AnyError> {
    let text = std::fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
    let pose = |(index, line): (usize, &str)| {
        let numbers: Result<Vec<f64>, _> = line.split(',').map(|number| number.trim().parse()).collect();
        match numbers?[..] {
            [x, y, z, qx, qy, qz, qw] => Ok(Pose::new([x, y, z], [qx, qy, qz, qw])?),
            _ => Err(AnyError::from(format!("{}:{}: seven numbers expected", file.display(), index + 1))),
        }
    };
    text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()).map(pose).collect()
}
