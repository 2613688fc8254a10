//! Questions to the plane map: rays, what is under a point, what carries a thing, floors and walls.

mod orientation;
mod ray;
mod support;

pub use orientation::{Surface, SurfaceConfig, SurfaceKind};
pub use ray::PlaneHit;
