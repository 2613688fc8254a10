use super::pose_problem::{PoseProblem, key_frame_poses};
use super::{LoopClosure, RefineConfig, RefineReport};
use crate::{Error, MapBuilder};

impl MapBuilder {
    /// Finds better poses of the key frames by the planes that they have seen, and [corrects](
    /// Self::correct_poses) all maps by them: a wall that was seen again after a while is one wall. The
    /// caller's poses count as odometry, see [`RefineConfig`]; what no plane holds stays as they have it. The
    /// first key frame stays where it is.
    ///
    /// Costs as many corrections as there are [rounds](RefineConfig::rounds), and a sparse solve for each.
    ///
    /// # Errors
    ///
    /// [`Error::Config`], [`Error::Refinement`] and those of [`Self::correct_poses`]. What rounds before have
    /// found stays.
    #[doc(alias = "bundle adjustment")]
    pub fn refine_poses(&mut self, config: &RefineConfig) -> Result<RefineReport, Error> {
        self.refine_poses_with(config, &[])
    }

    /// [`Self::refine_poses`], with loop closures that a place recognition has found. Wrong ones, which
    /// contradict the planes, the odometry and each other, are left out and named in the report.
    ///
    /// # Errors
    ///
    /// As [`Self::refine_poses`]; [`Error::UnknownFrame`] of a closure; [`Error::Refinement`] when its
    /// deviations are not positive.
    #[doc(alias = "pose graph")]
    pub fn refine_poses_with(
        &mut self,
        config: &RefineConfig,
        closures: &[LoopClosure],
    ) -> Result<RefineReport, Error> {
        config.validate()?;
        let log = self.map.past.log.as_ref().ok_or(Error::NoHistory)?;
        // Odometry stays what the caller gave, in all rounds.
        let given = key_frame_poses(log);
        let mut costs = Vec::new();
        loop {
            let log = self.map.past.log.as_ref().ok_or(Error::NoHistory)?;
            let found = PoseProblem::new(&self.map, log, &given, config, closures)?.solve()?;
            let correction = self.correct_poses(&found.poses)?;
            costs.push(found.cost);
            let is_settled = costs.len() > 1 && found.met_again == 0;
            if is_settled || costs.len() >= config.rounds {
                return Ok(RefineReport { found, costs, correction });
            }
        }
    }
}
