//! Algorithms on point clouds: exact DBSCAN, voxel grids, the weighted cloud map, outlier removal.
