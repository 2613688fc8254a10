//! Algorithms on point clouds: exact DBSCAN, voxel grids, outlier removal, principal axes,
//! convex hulls and minimum-area rectangles, oriented boxes and their overlap, isolation forests,
//! optimal assignment, searches of the nearest point, rigid alignment, segmentation of the thing in a box.

mod assignment;
mod box_tree;
mod convex_hull;
mod convex_polytope;
mod dbscan;
mod finite;
mod isolation_forest;
mod lattice;
mod minimum_area_rectangle;
mod oriented_box;
mod parallel;
mod point_tree;
mod principal_axes;
mod rigid_alignment;
mod segmentation;
mod statistical_outlier_removal;
mod voxel_grid;

pub use assignment::Assignment;
pub use convex_hull::{ConvexHullScratch, convex_hull, convex_hull_into};
pub use dbscan::{Clusters, Dbscan, DbscanConfig, DbscanScratch};
pub use isolation_forest::{IsolationForest, IsolationForestConfig, IsolationForestScratch, IsolationTrees};
pub use minimum_area_rectangle::{
    MinimumAreaRectangleScratch, OrientedRectangle, minimum_area_rectangle, minimum_area_rectangle_with,
};
pub use oriented_box::{
    BoxFit, OrientedBox, OrientedBoxError, OrientedBoxScratch, fit_oriented_box, fit_oriented_box_with,
};
pub use point_tree::PointTree;
pub use principal_axes::PrincipalAxes;
pub use rigid_alignment::rigid_alignment;
pub use segmentation::{
    BoxCluster, BoxSegmenter, BoxView, GridSample, NO_SAMPLE, SampleGrid, SegmentationConfig,
};
pub use statistical_outlier_removal::{
    StatisticalOutlierConfig, StatisticalOutlierRemoval, StatisticalOutlierReport,
};
pub use voxel_grid::{VoxelGrid, VoxelGridConfig, VoxelGridScratch};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
