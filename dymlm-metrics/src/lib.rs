//! Scores of a map against the truth, as plain data: points, cells, polygons, boxes.
//!
//! This crate neither renders nor maps. It scores any map whose truth is known: a cloud ([`score_cloud`]) and
//! an occupancy grid or octree ([`OccupancyScorer`]) against a [`SpaceTruth`], planes ([`score_planes`]) and
//! the thickness of a cloud's walls ([`score_walls`]) against [`TrueFace`]s, objects ([`score_objects`])
//! against [`TrueObject`]s, masks of movers ([`MaskScore`]), boxes of a tracker ([`TrackingScorer`]), and the
//! readings that a map keeps ([`DynamicMapScorer`]). A recording without movers is the truth for a recording
//! of the same place with movers: [`ReferenceCloud`]. The crate `dymlm-sim` renders sequences for which all
//! of this truth is known exactly.

mod assignment;
mod cloud_score;
mod dynamic_map_score;
mod free_space;
mod mask_score;
mod nearest;
mod object_score;
mod occupancy_score;
mod plane_score;
mod reference_cloud;
mod seen_points;
mod share;
mod space_truth;
mod spread;
mod tracking_score;
mod trajectory_score;
mod true_face;
mod true_object;
mod voxel_key;
mod voxel_means;
mod wall_score;

pub use cloud_score::{CloudScore, score_cloud};
pub use dynamic_map_score::{DynamicMapScore, DynamicMapScorer};
pub use mask_score::MaskScore;
pub use object_score::{
    Demand, DuplicateObject, EstimatedObject, LabelVerdict, ObjectMatch, ObjectScore, score_objects,
};
pub use occupancy_score::{
    FreeSpaceScore, Occupancy, OccupancyScore, OccupancyScorer, OccupiedCell, OccupiedCellScore, SurfaceScore,
};
pub use plane_score::{
    DuplicatePlane, EstimatedPlane, FaceScore, FaceState, Facing, MergedPlane, PlaneMatch, PlaneScore,
    score_planes,
};
pub use reference_cloud::{ReferenceCloud, ReferenceScore};
pub use seen_points::SeenPoints;
pub use space_truth::{PointTruth, SpaceTruth};
pub use spread::Spread;
pub use tracking_score::{IdentifiedBox, TrackingScore, TrackingScoreError, TrackingScorer};
pub use trajectory_score::TrajectoryScore;
pub use true_face::{CellRaster, FaceCells, TrueFace};
pub use true_object::{TrueObject, YawSymmetry};
pub use voxel_key::{VoxelKey, VoxelMap};
pub use wall_score::{WallScore, score_walls};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct ReadmeDoctests;
