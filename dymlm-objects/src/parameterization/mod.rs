//! From a detection's pixels to a box in space.

mod box_fitter;
mod completeness;
mod config;
mod edge_alignment;
mod flat_thing;
mod ground;
mod object_cluster;
mod observation;
mod parameterizer;
mod rival;
mod vertical;

pub use box_fitter::{BoxAxes, BoxFit, BoxFitter, BoxFitterConfig};
pub(crate) use completeness::ALONG_VIEW;
pub use completeness::{Completeness, SideView};
pub use config::ParameterizationConfig;
pub use observation::{ObjectObservation, Relief};
pub(crate) use parameterizer::Parameterizer;
pub(crate) use rival::Rival;
pub(crate) use vertical::Vertical;
#[cfg(feature = "state")]
pub(crate) use vertical::VerticalVotes;
