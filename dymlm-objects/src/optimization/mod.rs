//! What follows an observation: outliers, new parameters, duplicates, ghosts.

mod completion;
mod config;
mod duplicates;
mod existence;
mod outliers;
mod reparameterizer;

pub use config::UpdateConfig;
pub(crate) use duplicates::{are_duplicates, may_touch};
pub(crate) use existence::{Existence, judge_existence};
pub(crate) use reparameterizer::{MAX_IOU_LOSS, PRIOR_SLACK, Proposal, Reparameterizer};
