//! Algorithms on point clouds: exact DBSCAN, voxel grids, the weighted cloud map, outlier removal.

mod dbscan;

pub use dbscan::{Clusters, Dbscan, DbscanConfig, DbscanScratch};
