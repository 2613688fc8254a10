//! Algorithms on point clouds: exact DBSCAN, voxel grids, the weighted cloud map, outlier removal,
//! oriented boxes and their overlap.

mod cloud_map;
mod dbscan;
mod lattice;
mod oriented_box;
mod parallel;
mod statistical_outlier_removal;
mod symmetric_eigen3;
mod vector3;
mod voxel_grid;

pub use cloud_map::{
    CloudFrameReport, CloudMap, CloudMapConfig, CloudMapError, CloudVoxel, EvidenceConfig, Selection,
    Support, ThinningConfig, Verdict,
};
pub use dbscan::{Clusters, Dbscan, DbscanConfig, DbscanScratch};
pub use oriented_box::{OrientedBox, OrientedBoxError};
pub use statistical_outlier_removal::{
    StatisticalOutlierConfig, StatisticalOutlierRemoval, StatisticalOutlierReport,
};
pub use symmetric_eigen3::{SymmetricEigen3, symmetric_eigen3};
pub use voxel_grid::{VoxelGrid, VoxelGridConfig, VoxelGridScratch};
