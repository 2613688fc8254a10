use dymlm_core::{PinholeCamera, Pose};

/// The camera that took an image, and its pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: PinholeCamera,
    /// Its pose.
    pub world_from_camera: Pose,
}
