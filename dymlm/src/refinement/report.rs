use super::RefinedPoses;
use crate::CorrectionReport;

/// What [`MapBuilder::refine_poses`](crate::MapBuilder::refine_poses) has done.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RefineReport {
    /// What the last round has found whose poses the maps have followed.
    pub found: RefinedPoses,
    /// Half the sum of squared errors, in standard deviations, of each such round: before and after.
    pub costs: Vec<[f64; 2]>,
    /// What has become of the maps: of the last round.
    pub correction: CorrectionReport,
}
