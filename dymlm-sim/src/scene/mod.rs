//! What there is to see: convex bodies with materials, still or walking.

mod builder;
mod material;
mod office;
mod person;
mod shape;
mod walk;

use parry3d::math::Pose3;

pub(crate) use material::Material;
pub(crate) use person::Person;
pub(crate) use shape::Shape;

/// A room in its own frame: z up, the floor at z = 0, metres.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    /// The bodies that stay where they are.
    pub(crate) static_parts: Vec<Part>,
    /// The things that parts belong to.
    pub(crate) instances: Vec<Instance>,
    /// The people who walk.
    pub(crate) people: Vec<Person>,
}

/// A convex body of one material.
#[allow(clippy::struct_field_names, reason = "a pose is named with both frames")]
#[derive(Debug, Clone)]
pub(crate) struct Part {
    pub(crate) shape: Shape,
    pub(crate) scene_from_part: Pose3,
    pub(crate) material: Material,
    /// Index of the thing that it belongs to.
    pub(crate) instance: usize,
}

/// A thing: what a detector would draw one box around.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Instance {
    /// Its COCO label, if it has one: walls and cabinets have none.
    pub(crate) label: Option<&'static str>,
    pub(crate) motion: Motion,
    /// Where a thing that stays stands: its own frame has z up and its front towards -y.
    pub(crate) scene_from_thing: Pose3,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Motion {
    Still,
    Moves,
}

impl Scene {
    /// Puts the bodies of all people at `time` seconds into `parts`.
    pub(crate) fn moving_parts(&self, time: f64, parts: &mut Vec<Part>) {
        parts.clear();
        self.people.iter().for_each(|person| person.pose(time, parts));
    }

    /// Whether a thing moves.
    pub(crate) fn moves(&self, instance: usize) -> bool {
        self.instances.get(instance).is_some_and(|thing| thing.motion == Motion::Moves)
    }
}
