//! The scene: convex bodies with materials, still or moving.

mod activity;
mod another_day;
mod builder;
mod building;
mod carried;
mod cast;
mod contents;
mod design;
mod event;
mod furniture;
mod material;
mod office;
mod palette;
mod part;
mod person;
mod random_room;
mod room;
mod shape;
mod sight;
#[cfg(test)]
mod soundness;
mod staging;
mod table_top;
mod things;
mod tour;
mod two_tables;
mod viewpoint;
mod walk;

pub use activity::Activity;
pub(crate) use building::SECONDS_A_ROOM;
use carried::smooth;
pub use carried::{CarriedKind, CarriedMotion, CarriedObject};
pub(crate) use cast::Cast;
pub(crate) use contents::Scene;
pub use event::SceneEvent;
pub(crate) use material::{Material, surface_coordinates};
pub(crate) use part::{Instance, Motion, Part};
pub(crate) use person::Person;
pub use room::Room;
pub(crate) use shape::{Shape, face_normal};
use sight::first_hit;
pub(crate) use staging::Stage;
pub(crate) use tour::Tour;
pub(crate) use viewpoint::Viewpoint;
