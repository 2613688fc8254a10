use super::pose_problem::{KeyFramePose, PoseProblem, key_frame_poses};
use super::{LoopClosure, RefineConfig, RefineReport, RefinedPoses};
use crate::correction::JoinedCorrections;
use crate::{CorrectionProgress, Error, MapBuilder};

impl MapBuilder {
    /// Finds better poses of the key frames by the planes and the objects that they have seen, and
    /// [corrects](Self::correct_poses) all maps by them: a wall that was seen again after a while becomes one
    /// wall. Objects hold what planes do not, such as the way along a corridor. The caller's poses count as
    /// odometry, see [`RefineConfig`]; motions that nothing determines stay as the caller's poses have them.
    /// The first key frame stays where it is.
    ///
    /// Rounds of a sparse solve and a correction follow each other until the poses stay where they are, or up
    /// to the [greatest number](RefineConfig::rounds).
    ///
    /// # Errors
    ///
    /// [`Error::Config`], [`Error::Refinement`] and those of [`Self::correct_poses`]; nothing has changed.
    /// [`Error::RefinementStopped`] where a later round fails: what the rounds before it have found stays in the
    /// maps, and the error has their report.
    #[doc(alias = "bundle adjustment")]
    pub fn refine_poses(&mut self, config: &RefineConfig) -> Result<RefineReport, Error> {
        self.refine_poses_with(config, &[])
    }

    /// [`Self::refine_poses`], with loop closures that a place recognition has found. Wrong closures, which
    /// contradict the planes, the odometry and each other, are left out and named in the report. A closure is
    /// moved to the key frames at or before its frames; where both have the same one, it says nothing.
    ///
    /// # Errors
    ///
    /// As [`Self::refine_poses`]; [`Error::UnknownFrame`] when a closure names a frame that was never
    /// inserted; [`Error::LoopClosureDeviations`] when its deviations are not positive;
    /// [`Error::NoKeyFrames`] when there are closures but no key frames.
    #[doc(alias = "pose graph")]
    pub fn refine_poses_with(
        &mut self,
        config: &RefineConfig,
        closures: &[LoopClosure],
    ) -> Result<RefineReport, Error> {
        self.refine_watched(config, closures, &mut |_| true)
    }

    /// [`Self::refine_poses_with`] whose corrections report their progress.
    fn refine_watched(
        &mut self,
        config: &RefineConfig,
        closures: &[LoopClosure],
        watch: &mut dyn FnMut(CorrectionProgress) -> bool,
    ) -> Result<RefineReport, Error> {
        config.validate()?;
        let log = self.map.past.log.as_ref().ok_or(Error::NoHistory)?;
        // The caller's poses remain the odometry in all rounds.
        let given = key_frame_poses(log);
        let mut rounds = JoinedCorrections::of(&self.map);
        let found = self.solve_for_poses(&given, config, closures)?;
        let correction = self.correct_poses_watched(&found.poses, watch)?;
        rounds.add(&correction);
        let mut report = RefineReport { costs: vec![found.cost], found, correction };
        while report.costs.len() < config.rounds {
            let further = self.solve_for_poses(&given, config, closures).and_then(|found| {
                let is_settled = are_settled(&report.found, &found, config);
                let correction =
                    if is_settled { None } else { Some(self.correct_poses_watched(&found.poses, watch)?) };
                Ok((found, correction))
            });
            match further {
                Ok((found, Some(correction))) => {
                    rounds.add(&correction);
                    report.costs.push(found.cost);
                    let log = self.map.past.log.as_ref().ok_or(Error::NoHistory)?;
                    (report.found, report.correction) = (found, rounds.report(&self.map, log));
                }
                Ok((_, None)) => break,
                Err(source) => {
                    let (source, done) = (Box::new(source), Box::new(report));
                    return Err(Error::RefinementStopped { source, done });
                }
            }
        }
        Ok(report)
    }

    fn solve_for_poses(
        &self,
        given: &[KeyFramePose],
        config: &RefineConfig,
        closures: &[LoopClosure],
    ) -> Result<RefinedPoses, Error> {
        let log = self.map.past.log.as_ref().ok_or(Error::NoHistory)?;
        PoseProblem::new(&self.map, log, given, config, closures)?.solve()
    }
}

/// Whether the poses have moved, in the root mean square, by less than the errors of each frame alone.
fn are_settled(before: &RefinedPoses, after: &RefinedPoses, config: &RefineConfig) -> bool {
    let pairs = || before.poses.iter().zip(&after.poses).map(|((_, before), (_, after))| (before, after));
    let moved: f64 = pairs().map(|(before, after)| before.distance(after).powi(2)).sum();
    let turned: f64 = pairs().map(|(before, after)| before.angle(after).powi(2)).sum();
    let count = before.poses.len() as f64;
    let [translation, rotation] = [config.translation_jitter, config.rotation_jitter].map(|c| c * c * count);
    moved <= translation && turned <= rotation
}

#[cfg(test)]
mod tests {
    use dymlm_core::{PinholeCamera, Pose};
    use dymlm_sim::{PoseErrorConfig, Sequence, SequenceConfig};

    use super::*;
    use crate::{HistoryConfig, MapConfig};

    #[test]
    fn a_round_that_fails_tells_what_those_before_it_have_done() {
        let mut config = SequenceConfig::default();
        (config.frames, config.pose_error) = (90, PoseErrorConfig::slam());
        config.camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).ok();
        let sequence = Sequence::new(&config).unwrap();
        let mut config = MapConfig::default();
        (config.history, config.cloud.voxel_size) = (HistoryConfig::Memory, 0.06);
        let mut builder = MapBuilder::new(config).unwrap();
        for (index, simulated) in sequence.frames().enumerate().step_by(3) {
            let pose = sequence.estimated_pose(index);
            builder.insert(&simulated.frame, &simulated.detections, &pose).unwrap();
        }
        let newest = |builder: &MapBuilder| builder.trajectory().map(|(_, _, pose)| pose).last();
        let before: Pose = newest(&builder).unwrap();

        // The second correction is cancelled; poses never count as settled.
        let mut refine = RefineConfig::default();
        (refine.translation_jitter, refine.rotation_jitter) = (1e-6, 1e-6);
        let (mut done, mut corrections) = (usize::MAX, 0);
        let mut watch = |progress: CorrectionProgress| {
            corrections += u32::from(progress.done <= done);
            done = progress.done;
            corrections < 2
        };
        let stopped = builder.refine_watched(&refine, &[], &mut watch);
        let Err(Error::RefinementStopped { source, done }) = stopped else { panic!("{stopped:?}") };
        assert!(matches!(*source, Error::Cancelled));
        assert_eq!(done.costs.len(), 1);
        let (now, followed) = (newest(&builder).unwrap(), done.correction.new_from_old * before);
        assert!(now != before && followed.distance(&now) < 1e-9 && followed.angle(&now) < 1e-9);
    }
}
