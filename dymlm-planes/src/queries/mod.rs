//! Queries of the plane map: rays, planes under a point, supporting planes, floors and walls.

mod level;
mod orientation;
mod ray;
mod support;

pub use level::LevelUnder;
pub use orientation::{Surface, SurfaceConfig, SurfaceKind};
pub use ray::PlaneHit;
