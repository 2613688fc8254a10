use crate::CorrectionReport;

/// What [`MapBuilder::refine_poses`](crate::MapBuilder::refine_poses) has done.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct RefineReport {
    /// Planes that more than one key frame has seen, in the last round.
    pub planes: usize,
    /// Views of these.
    pub views: usize,
    /// Half the sum of squared errors, in standard deviations, of each round: before and after.
    pub costs: Vec<[f64; 2]>,
    /// Loop closures that were left out as wrong, by their places in the list: in the last round.
    pub left_out: Vec<usize>,
    /// What has become of the maps: of the last round.
    pub correction: CorrectionReport,
}
