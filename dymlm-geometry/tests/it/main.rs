//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod assignment;
mod common;
mod dbscan;
mod growth;
mod isolation_forest;
mod minimal_box;
mod minimum_area_rectangle;
mod oriented_box;
mod oriented_box_fit;
mod point_tree;
mod principal_axes;
mod rigid_alignment;
mod statistical_outlier_removal;
mod voxel_grid;
