use parry3d::math::{Pose3, Vec3};

/// Where a camera finds its place in a room, in a frame of its own: x to the right, y to what it looks at, z
/// up from the floor. The paths keep within 0.85 m of the line from the pivot to the station, 0.3 m behind
/// and 0.75 m before the station.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Viewpoint {
    pub(crate) scene_from_view: Pose3,
    /// Where the camera rests.
    pub(crate) station: Vec3,
    /// What it looks at.
    pub(crate) target: Vec3,
    /// What it circles when it moves on a half sphere.
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
