//! Maps that follow when poses are corrected: see
//! [`MapBuilder::correct_poses`](crate::MapBuilder::correct_poses).

mod correct_poses;
mod identities;
#[cfg(feature = "refine")]
mod joined;
mod new_poses;
#[cfg(test)]
mod random_sessions;
mod rebuilt;
mod report;
mod thing_changes;

pub(crate) use identities::leading_ids;
#[cfg(feature = "refine")]
pub(crate) use joined::JoinedCorrections;
pub use report::{CorrectionProgress, CorrectionReport, ThingChanges, ThingMotion};
