use dymlm_core::{PinholeCamera, Pose};

/// From where an image was seen: the camera and its pose.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct View {
    /// The camera.
    pub camera: PinholeCamera,
    /// Its pose.
    pub world_from_camera: Pose,
}
