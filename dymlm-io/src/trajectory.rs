use std::fs;
use std::io::{self, Write};
use std::path::Path;

use dymlm_core::Pose;
use serde::{Deserialize, Serialize};

use crate::text_lines::{content_lines, number};
use crate::{Error, UncoveredTime, write_atomically};

/// A camera pose at a time.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct StampedPose {
    /// Time, seconds.
    pub timestamp: f64,
    /// Takes camera coordinates to the world.
    pub world_from_camera: Pose,
}

/// A time interval between two poses of a trajectory that is too long for interpolation.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct TrajectoryGap {
    /// Time of the last pose before the gap, seconds.
    pub from: f64,
    /// Time of the first pose after the gap, seconds.
    pub to: f64,
}

/// Camera poses over time, in time order.
///
/// Read and written as TUM trajectories: one pose per line, `timestamp tx ty tz qx qy qz qw`, camera to
/// world, metres; lines that begin with `#` are comments. Between two poses the translation is interpolated
/// linearly and the rotation on the shorter great circle (slerp: Shoemake 1985). Nothing is ever
/// extrapolated.
///
/// ```
/// use dymlm_core::Pose;
/// use dymlm_io::{StampedPose, Trajectory};
///
/// let at = |timestamp, x| -> Result<_, dymlm_core::Error> {
///     Ok(StampedPose { timestamp, world_from_camera: Pose::new([x, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])? })
/// };
/// let trajectory = Trajectory::new(vec![at(0.0, 0.0)?, at(0.1, 2.0)?])?;
/// assert_eq!(trajectory.pose_at(0.05, 0.2)?.translation(), [1.0, 0.0, 0.0]);
/// assert!(trajectory.pose_at(0.05, 0.02).is_err(), "a gap");
/// assert!(trajectory.pose_at(0.15, 0.2).is_err(), "after its end");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Trajectory {
    poses: Vec<StampedPose>,
}

/// The content of a trajectory file.
#[derive(Debug, Default)]
pub(crate) struct TrajectoryFile {
    pub(crate) trajectory: Trajectory,
    /// Line number of each pose.
    pub(crate) lines: Vec<usize>,
    /// Errors of the lines that cannot be used.
    pub(crate) faults: Vec<Error>,
}

impl Trajectory {
    /// A time within this many seconds of a pose's own time has that pose, even beside a gap or at the ends:
    /// files that give one time with 4 and with 6 decimals mean the same time.
    pub const SAME_TIME: f64 = 1e-4;

    /// A trajectory of the given poses, in any order. Of two poses with the same time the first is kept.
    ///
    /// # Errors
    ///
    /// [`dymlm_core::Error::Timestamp`] when a time is not finite.
    pub fn new(mut poses: Vec<StampedPose>) -> Result<Self, dymlm_core::Error> {
        if let Some(bad) = poses.iter().find(|pose| !pose.timestamp.is_finite()) {
            return Err(dymlm_core::Error::Timestamp(bad.timestamp));
        }
        poses.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
        poses.dedup_by(|later, first| later.timestamp == first.timestamp);
        Ok(Self { poses })
    }

    /// Reads a TUM trajectory.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] when the file cannot be read; [`Error::Line`] for the first line that is not a pose, or
    /// that gives another pose for the time of an earlier line.
    pub fn read(path: impl AsRef<Path>) -> Result<Self, Error> {
        let file = TrajectoryFile::read(path.as_ref())?;
        file.faults.into_iter().next().map_or(Ok(file.trajectory), Err)
    }

    /// Writes a TUM trajectory, atomically. Numbers are written with all digits that are needed to read the
    /// same value back.
    ///
    /// # Errors
    ///
    /// As [`write_atomically`].
    pub fn write(&self, path: impl AsRef<Path>) -> Result<(), Error> {
        write_atomically(path, |out| self.encode(out))
    }

    /// Writes a TUM trajectory to a stream.
    ///
    /// # Errors
    ///
    /// Those of the stream.
    pub fn encode(&self, out: &mut dyn Write) -> io::Result<()> {
        writeln!(out, "# timestamp tx ty tz qx qy qz qw (world from camera)")?;
        for pose in &self.poses {
            let [tx, ty, tz] = pose.world_from_camera.translation();
            let [qx, qy, qz, qw] = pose.world_from_camera.quaternion();
            writeln!(out, "{} {tx} {ty} {tz} {qx} {qy} {qz} {qw}", pose.timestamp)?;
        }
        Ok(())
    }

    /// The poses, in time order.
    pub fn poses(&self) -> &[StampedPose] {
        &self.poses
    }

    /// The pose at a time in seconds: a given pose within [`Self::SAME_TIME`] of it, else a pose interpolated
    /// between the two poses around it when they are at most `max_gap` seconds apart.
    ///
    /// # Errors
    ///
    /// [`UncoveredTime`] for a time outside the trajectory or in a gap.
    pub fn pose_at(&self, timestamp: f64, max_gap: f64) -> Result<Pose, UncoveredTime> {
        let after = self.poses.partition_point(|pose| pose.timestamp <= timestamp);
        let previous = after.checked_sub(1).and_then(|before| self.poses.get(before));
        let next = self.poses.get(after);
        if let Some(own) = own_pose(previous, next, timestamp) {
            return Ok(own);
        }
        match (previous, next) {
            (Some(a), Some(b)) if !is_gap(a, b, max_gap) => {
                let fraction = (timestamp - a.timestamp) / (b.timestamp - a.timestamp);
                Ok(a.world_from_camera.interpolate(&b.world_from_camera, fraction))
            }
            (Some(a), Some(b)) => {
                Err(UncoveredTime::Gap { timestamp, from: a.timestamp, to: b.timestamp, max_gap })
            }
            (None, Some(first)) => Err(UncoveredTime::Before { timestamp, first: first.timestamp }),
            (Some(last), None) => Err(UncoveredTime::After { timestamp, last: last.timestamp }),
            (None, None) => Err(UncoveredTime::Empty { timestamp }),
        }
    }

    /// The intervals between successive poses that are longer than `max_gap` seconds, in time order.
    pub fn gaps(&self, max_gap: f64) -> Vec<TrajectoryGap> {
        let neighbours = self.poses.windows(2).filter_map(|pair| Some((pair.first()?, pair.last()?)));
        neighbours
            .filter(|(a, b)| is_gap(a, b, max_gap))
            .map(|(a, b)| TrajectoryGap { from: a.timestamp, to: b.timestamp })
            .collect()
    }
}

impl TrajectoryFile {
    /// Reads all lines that can be used, and lists the errors of the others.
    pub(crate) fn read(path: &Path) -> Result<Self, Error> {
        let bytes = fs::read(path).map_err(Error::io(path))?;
        let mut faults = Vec::new();
        let mut stamped: Vec<(StampedPose, usize)> = Vec::new();
        for (line, content) in content_lines(&bytes) {
            match content.and_then(parse_pose) {
                Ok(pose) => stamped.push((pose, line)),
                Err(reason) => faults.push(Error::line(path, line, reason)),
            }
        }
        // The sort is stable: of two lines with the same time the first in the file is kept.
        stamped.sort_by(|a, b| a.0.timestamp.total_cmp(&b.0.timestamp));
        stamped.dedup_by(|(later, line), (first, first_line)| {
            let again = later.timestamp == first.timestamp;
            if again && later.world_from_camera != first.world_from_camera {
                let reason = format!("another pose for {} s than line {first_line}", first.timestamp);
                faults.push(Error::line(path, *line, reason));
            }
            again
        });
        let (poses, lines) = stamped.into_iter().unzip();
        Ok(Self { trajectory: Trajectory { poses }, lines, faults })
    }

    /// The line of the last pose at or before a time, or of the first pose; 1 when there are no poses.
    pub(crate) fn line_at(&self, timestamp: f64) -> usize {
        let after = self.trajectory.poses.partition_point(|pose| pose.timestamp <= timestamp);
        self.lines.get(after.saturating_sub(1)).copied().unwrap_or(1)
    }
}

/// Whether two successive poses are too far apart. A tiny excess is rounding: 0.3 - 0.1 is more than 0.2.
fn is_gap(a: &StampedPose, b: &StampedPose, max_gap: f64) -> bool {
    b.timestamp - a.timestamp > max_gap + Trajectory::SAME_TIME
}

/// The nearer of two poses, if `timestamp` is within [`Trajectory::SAME_TIME`] of its time.
fn own_pose(previous: Option<&StampedPose>, next: Option<&StampedPose>, timestamp: f64) -> Option<Pose> {
    let distance = |pose: &&StampedPose| (pose.timestamp - timestamp).abs();
    [previous, next]
        .into_iter()
        .flatten()
        .filter(|pose| distance(pose) <= Trajectory::SAME_TIME)
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))
        .map(|pose| pose.world_from_camera)
}

/// `timestamp tx ty tz qx qy qz qw`.
fn parse_pose(line: &str) -> Result<StampedPose, String> {
    let mut values = [0.0; 8];
    let mut columns = 0;
    for field in line.split_ascii_whitespace() {
        if let Some(value) = values.get_mut(columns) {
            *value = number(field)?;
        }
        columns += 1;
    }
    if columns != values.len() {
        return Err(format!("{columns} columns instead of the 8 of timestamp tx ty tz qx qy qz qw"));
    }
    let [timestamp, tx, ty, tz, qx, qy, qz, qw] = values;
    let world_from_camera = Pose::new([tx, ty, tz], [qx, qy, qz, qw]).map_err(|error| error.to_string())?;
    Ok(StampedPose { timestamp, world_from_camera })
}
