use parry3d::math::{Rot3, Vec3};

/// The top of a table, on which things can stand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct TableTop {
    pub(super) center: [f32; 2],
    pub(super) yaw: f32,
    /// Full lengths along the table's axes.
    pub(super) size: [f32; 2],
    pub(super) height: f32,
}

impl TableTop {
    /// The point of the scene on the table's top at `[x, y]` along the table's axes.
    pub(super) fn point(&self, [x, y]: [f32; 2]) -> [f32; 3] {
        let turned = Rot3::from_rotation_z(self.yaw) * Vec3::new(x, y, 0.0);
        [self.center[0] + turned.x, self.center[1] + turned.y, self.height]
    }
}
