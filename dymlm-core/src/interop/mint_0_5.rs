use mint::{Quaternion, Vector3};

use crate::{Error, Pose};

impl TryFrom<(Quaternion<f64>, Vector3<f64>)> for Pose {
    type Error = Error;

    /// From a rotation and a translation in metres.
    fn try_from((rotation, translation): (Quaternion<f64>, Vector3<f64>)) -> Result<Self, Error> {
        let Vector3 { x, y, z } = rotation.v;
        Self::new(translation.into(), [x, y, z, rotation.s])
    }
}

impl From<Pose> for (Quaternion<f64>, Vector3<f64>) {
    fn from(pose: Pose) -> Self {
        let [x, y, z, s] = pose.quaternion();
        (Quaternion { v: Vector3 { x, y, z }, s }, pose.translation().into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip() {
        let pose = Pose::new([1.0, -2.0, 3.0], [0.5, -0.5, 0.5, 0.5]).unwrap();
        let parts: (Quaternion<f64>, Vector3<f64>) = pose.into();
        assert_eq!(Pose::try_from(parts).unwrap(), pose);
    }
}
