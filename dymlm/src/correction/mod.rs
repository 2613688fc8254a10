//! Maps that follow when poses are corrected: see
//! [`MapBuilder::correct_poses`](crate::MapBuilder::correct_poses).

mod correct_poses;
mod identities;
mod new_poses;
#[cfg(test)]
mod random_sessions;
mod rebuilt;
mod report;
mod thing_changes;

pub(crate) use identities::leading_ids;
pub use report::{CorrectionProgress, CorrectionReport, ThingChanges, ThingMotion};
