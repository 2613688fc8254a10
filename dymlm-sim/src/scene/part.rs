use parry3d::math::Pose3;

use super::{Material, Shape};

/// A convex body of one material.
#[allow(clippy::struct_field_names, reason = "a pose is named with both frames")]
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub(crate) shape: Shape,
    pub(crate) scene_from_part: Pose3,
    pub(crate) material: Material,
    /// Index of the thing that the body belongs to.
    pub(crate) instance: usize,
}

/// A thing: everything that a detector would enclose in one box.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Instance {
    /// Its COCO label, if it has one: walls and cabinets have none.
    pub(crate) label: Option<&'static str>,
    pub(crate) motion: Motion,
    /// Pose of a thing that stays; its own frame has z up and the thing's front towards -y.
    pub(crate) scene_from_thing: Pose3,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Motion {
    Still,
    Moves,
}
