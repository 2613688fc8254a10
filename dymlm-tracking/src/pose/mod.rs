//! The pose of a rigid body from 3D points, from pixels, or from both.

mod observation;
mod p3p;
mod ransac;
mod refine;
mod step;

pub use observation::PoseObservation;
pub use p3p::p3p;
pub use ransac::{PoseConsensus, PoseRansac, RansacConfig};
pub(crate) use refine::{PosePrior, pixel_motion};
pub use refine::{PoseRefiner, RefinedPose, RobustKernel};
pub(crate) use step::{moved, rotation_about, step_between};
