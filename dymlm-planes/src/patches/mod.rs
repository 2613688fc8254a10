//! The voxels of planes' inliers, in blocks, and a spatial index of the planes.

mod block;
mod patch;
mod plane_index;
mod voxel_box;
mod voxel_lists;

pub(crate) use block::BlockKey;
#[cfg(feature = "state")]
pub(crate) use patch::SavedBlock;
pub(crate) use patch::{CoarseCell, Patch, PatchVoxel, reach};
pub(crate) use plane_index::PlaneIndex;
pub(crate) use voxel_box::VoxelBox;
pub(crate) use voxel_lists::VoxelLists;
