use glam::{DAffine3, DQuat, DVec3};

use crate::{Error, Pose};

impl TryFrom<(DQuat, DVec3)> for Pose {
    type Error = Error;

    /// From a rotation and a translation in metres.
    fn try_from((rotation, translation): (DQuat, DVec3)) -> Result<Self, Error> {
        Self::new(translation.to_array(), rotation.to_array())
    }
}

impl From<Pose> for (DQuat, DVec3) {
    fn from(pose: Pose) -> Self {
        (DQuat::from_array(pose.quaternion()), DVec3::from_array(pose.translation()))
    }
}

impl From<Pose> for DAffine3 {
    fn from(pose: Pose) -> Self {
        let (rotation, translation) = pose.into();
        Self::from_rotation_translation(rotation, translation)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn round_trip() {
        let pose = Pose::new([1.0, -2.0, 3.0], [0.5, -0.5, 0.5, 0.5]).unwrap();
        let parts: (DQuat, DVec3) = pose.into();
        assert_eq!(Pose::try_from(parts).unwrap(), pose);
        let moved = DAffine3::from(pose).transform_point3(DVec3::new(0.3, 0.2, 0.1)).to_array();
        let expected = pose.transform_point([0.3, 0.2, 0.1]);
        assert!((0..3).all(|axis| (moved[axis] - expected[axis]).abs() < 1e-12));
    }
}
