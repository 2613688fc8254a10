//! Algorithms on point clouds: exact DBSCAN, voxel grids, the weighted cloud map, outlier removal.

mod dbscan;
mod lattice;
mod parallel;

pub use dbscan::{Clusters, Dbscan, DbscanConfig, DbscanScratch};
