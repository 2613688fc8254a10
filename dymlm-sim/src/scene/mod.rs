//! What there is to see: convex bodies with materials, still or moving.

mod activity;
mod builder;
mod carried;
mod furniture;
mod material;
mod office;
mod palette;
mod person;
mod random_room;
mod room;
mod shape;
#[cfg(test)]
mod soundness;
mod table_top;
mod things;
mod two_tables;
mod viewpoint;
mod walk;

use parry3d::math::Pose3;
use rand::RngExt;

use crate::noise::{Use, stream};

pub use activity::Activity;
pub(crate) use carried::Carried;
pub use carried::{CarriedKind, CarriedMotion, CarriedObject};
pub(crate) use material::{Material, surface_coordinates};
pub(crate) use person::Person;
pub use room::Room;
pub(crate) use shape::{Shape, face_normal};
pub(crate) use viewpoint::Viewpoint;

/// A room in its own frame: z up, the floor at z = 0, metres.
#[derive(Debug, Clone)]
pub(crate) struct Scene {
    /// The bodies that stay where they are.
    pub(crate) static_parts: Vec<Part>,
    /// The things that parts belong to.
    pub(crate) instances: Vec<Instance>,
    pub(crate) people: Vec<Person>,
    /// The thing that a hand carries, if there is one.
    pub(crate) carried: Option<Carried>,
    /// Where the camera finds its place.
    pub(crate) viewpoint: Viewpoint,
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
    /// A room with up to two people; the seed decides where they start, or all of a random room.
    pub(crate) fn new(room: Room, activity: Activity, people: usize, seed: u64) -> Self {
        let mut rng = stream(seed, Use::Scene, 0, 0);
        let choice = std::array::from_fn(|_| std::array::from_fn(|_| rng.random_range(0.0..1.0)));
        match (room, activity) {
            (Room::Office, Activity::Walking) => Self::office(people, choice),
            (Room::Office, Activity::Sitting) => Self::seated_office(people, choice),
            (Room::TwoTables, _) => Self::two_tables(activity, people, choice),
            (Room::Random, _) => Self::random_room(activity, people, seed),
        }
    }

    /// Puts the bodies of all people and of the carried thing at `time` seconds into `parts`.
    pub(crate) fn moving_parts(&self, time: f64, parts: &mut Vec<Part>) {
        parts.clear();
        self.people.iter().for_each(|person| person.pose(time, parts));
        self.carried.iter().for_each(|carried| carried.pose(time, parts));
    }

    /// Whether a thing moves.
    pub(crate) fn moves(&self, instance: usize) -> bool {
        self.instances.get(instance).is_some_and(|thing| thing.motion == Motion::Moves)
    }
}
