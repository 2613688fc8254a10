//! Convex hulls of points in space: [`QuickHull`] computes them, [`VertexGraph`] finds how far they extend,
//! and [`InnerCones`] finds points that are surely inside.

mod facet;
mod inner_cones;
mod quick_hull;
mod vertex_graph;

pub(crate) use inner_cones::InnerCones;
pub(crate) use quick_hull::QuickHull;
pub(crate) use vertex_graph::VertexGraph;
