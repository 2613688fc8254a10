use super::RefinedPoses;
use crate::CorrectionReport;

/// What [`MapBuilder::refine_poses`](crate::MapBuilder::refine_poses) has done.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RefineReport {
    /// The result of the last round whose poses were applied to the maps.
    pub found: RefinedPoses,
    /// Half the sum of squared errors, in standard deviations, before and after each applied round.
    pub costs: Vec<[f64; 2]>,
    /// What the corrections of all applied rounds have changed together.
    pub correction: CorrectionReport,
}
