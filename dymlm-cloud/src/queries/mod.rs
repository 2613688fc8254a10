//! Questions to the static cloud: what is nearest, what is in a box, what a ray meets, which way a surface
//! faces.

mod nearest;
mod normal;
mod ray;
mod region;
mod static_points;

pub use normal::SurfaceNormal;
pub use ray::PointHit;
pub use static_points::{StaticPoint, StaticPoints};
