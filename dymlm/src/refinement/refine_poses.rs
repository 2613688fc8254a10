use super::pose_problem::{KeyFramePose, PoseProblem, key_frame_poses};
use super::{LoopClosure, RefineConfig, RefineReport, RefinedPoses};
use crate::{Error, MapBuilder};

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
    /// [`Error::Config`], [`Error::Refinement`] and those of [`Self::correct_poses`]. What earlier rounds
    /// have found stays in the maps.
    #[doc(alias = "bundle adjustment")]
    pub fn refine_poses(&mut self, config: &RefineConfig) -> Result<RefineReport, Error> {
        self.refine_poses_with(config, &[])
    }

    /// [`Self::refine_poses`], with loop closures that a place recognition has found. Wrong closures, which
    /// contradict the planes, the odometry and each other, are left out and named in the report.
    ///
    /// # Errors
    ///
    /// As [`Self::refine_poses`]; [`Error::UnknownFrame`] when a closure names a frame that was never
    /// inserted; [`Error::Refinement`] when its deviations are not positive.
    #[doc(alias = "pose graph")]
    pub fn refine_poses_with(
        &mut self,
        config: &RefineConfig,
        closures: &[LoopClosure],
    ) -> Result<RefineReport, Error> {
        config.validate()?;
        let log = self.map.past.log.as_ref().ok_or(Error::NoHistory)?;
        // The caller's poses remain the odometry in all rounds.
        let given = key_frame_poses(log);
        let mut found = self.solve_for_poses(&given, config, closures)?;
        let mut costs = Vec::new();
        loop {
            let correction = self.correct_poses(&found.poses)?;
            costs.push(found.cost);
            if costs.len() >= config.rounds {
                return Ok(RefineReport { found, costs, correction });
            }
            let next = self.solve_for_poses(&given, config, closures)?;
            if are_settled(&found, &next, config) {
                return Ok(RefineReport { found, costs, correction });
            }
            found = next;
        }
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
