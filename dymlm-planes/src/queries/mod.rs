//! Questions to the plane map: rays, what is under a point, what a thing rests on, floors and walls.

mod orientation;
mod ray;
mod support;

pub use orientation::{Surface, SurfaceConfig, SurfaceKind};
pub use ray::PlaneHit;
