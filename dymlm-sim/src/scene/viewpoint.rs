use parry3d::math::{Pose3, Vec3};

/// Where the camera is and looks in a room, in a frame of its own: x to the right, y ahead, z up from the
/// floor. The paths stay within 0.85 m to the sides of the pivot or the station, and from 0.3 m behind the
/// station to 0.75 m before it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Viewpoint {
    pub(crate) scene_from_view: Pose3,
    /// The camera's position at rest.
    pub(crate) station: Vec3,
    /// The point that it looks at.
    pub(crate) target: Vec3,
    /// The point that it circles when it moves on a half sphere.
    pub(crate) pivot: Vec3,
}

impl Viewpoint {
    /// In the office: about 3 m before the desk, looking just above it.
    pub(crate) const OFFICE: Self = Self {
        scene_from_view: Pose3::IDENTITY,
        station: Vec3::new(0.15, -1.45, 1.45),
        target: Vec3::new(-0.05, 1.7, 0.9),
        pivot: Vec3::new(0.0, -0.25, 0.95),
    };
}
