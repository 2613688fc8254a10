//! Planes and objects as viewers draw them: triangles and lines (features `mcap`, `gltf`).

mod object_lines;
#[cfg(feature = "mcap")]
mod outline_cloud;
mod plane_mesh;
#[cfg(feature = "gltf")]
mod unit_ball;

#[cfg(feature = "gltf")]
pub(crate) use object_lines::BOX_TRIANGLES;
pub(crate) use object_lines::{box_edges, unit_circles};
#[cfg(feature = "mcap")]
pub use outline_cloud::outline_cloud;
pub(crate) use plane_mesh::PlaneMesh;
#[cfg(feature = "gltf")]
pub(crate) use unit_ball::unit_ball;
