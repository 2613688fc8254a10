use dymlm_core::Pose;
use nalgebra::{Isometry3, Quaternion, Translation3, UnitQuaternion};

pub(crate) fn isometry(pose: &Pose) -> Isometry3<f64> {
    let [x, y, z, w] = pose.quaternion();
    let rotation = UnitQuaternion::new_normalize(Quaternion::new(w, x, y, z));
    Isometry3::from_parts(Translation3::from(pose.translation()), rotation)
}

/// `None` where numbers are not finite.
pub(crate) fn pose(isometry: &Isometry3<f64>) -> Option<Pose> {
    let rotation = isometry.rotation.coords;
    Pose::new(isometry.translation.vector.into(), rotation.into()).ok()
}
