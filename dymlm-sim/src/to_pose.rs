use dymlm_core::Pose;
use parry3d::math::Pose3;

/// A pose of the renderer as a [`Pose`]. (The renderer's rotations are unit quaternions, so none is refused.)
pub(crate) fn to_pose(pose: &Pose3) -> Pose {
    let translation = pose.translation.to_array().map(f64::from);
    Pose::new(translation, pose.rotation.to_array().map(f64::from)).unwrap_or_default()
}
