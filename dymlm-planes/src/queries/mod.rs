//! Questions to the plane map: rays, what is under a point, what a thing rests on, floors and walls.

mod level;
mod orientation;
mod ray;
mod support;

pub use level::LevelUnder;
pub use orientation::{Surface, SurfaceConfig, SurfaceKind};
pub use ray::PlaneHit;
