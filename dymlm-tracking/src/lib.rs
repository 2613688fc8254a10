//! Follows a moved object through images.
mod error;
mod flow;
mod gray_image;
mod kcf;
mod object;
mod pose;

pub use error::Error;
pub use flow::{
    Corner, CornerConfig, CornerDetector, FlowConfig, FlowPoint, FlowStatus, ImagePyramid, Lighting,
    OpticalFlow,
};
pub use gray_image::GrayImage;
pub use kcf::{KcfConfig, KcfFeatures, KcfTracker, KcfUpdate, Learning};
pub use object::{
    ObjectModel, ObjectState, ObjectTracker, ObjectTrackerConfig, ObjectUpdate, RestReport, SurfacePoint,
};
pub use pose::{
    PoseConsensus, PoseObservation, PoseRansac, PoseRefiner, RansacConfig, RefinedPose, RefinerConfig,
    RobustKernel, p3p, rigid_alignment,
};
