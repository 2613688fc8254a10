use nalgebra::{Isometry3, Translation3, UnitQuaternion};

use crate::{Error, Pose};

impl TryFrom<Isometry3<f64>> for Pose {
    type Error = Error;

    fn try_from(isometry: Isometry3<f64>) -> Result<Self, Error> {
        Self::new(isometry.translation.vector.into(), isometry.rotation.coords.into())
    }
}

impl From<Pose> for Isometry3<f64> {
    fn from(pose: Pose) -> Self {
        let [x, y, z, w] = pose.quaternion();
        let rotation = UnitQuaternion::new_unchecked(nalgebra::Quaternion::new(w, x, y, z));
        Self::from_parts(Translation3::from(pose.translation()), rotation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip() {
        let pose = Pose::new([1.0, -2.0, 3.0], [0.5, -0.5, 0.5, 0.5]).unwrap();
        assert_eq!(Pose::try_from(Isometry3::from(pose)).unwrap(), pose);
    }
}
