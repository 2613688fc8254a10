//! How far maps and masks are from the truth.

mod assignment;
mod cell_grid;
mod cloud_score;
mod detector_statistics;
mod dynamic_map_score;
mod faces;
mod free_space;
mod mask_score;
mod nearest;
mod object_score;
mod objects;
mod occupancy_score;
mod plane_score;
mod reference_cloud;
mod seen_points;
mod spread;
mod surfaces;
mod swept_volume;
mod tracking_score;
mod truth;
mod voxel_key;

pub use cloud_score::{CloudScore, score_cloud};
pub use detector_statistics::{
    DetectorFigures, DetectorStatistics, ExactView, FigureRow, SideFigures, SizeFigures,
};
pub use dynamic_map_score::{DynamicMapScore, DynamicMapScoreConfig, DynamicMapScorer};
pub use faces::TrueFace;
pub use mask_score::MaskScore;
pub use object_score::{
    Demand, DuplicateObject, EstimatedObject, LabelVerdict, ObjectMatch, ObjectScore, ObjectScoreConfig,
    score_objects,
};
pub use objects::{TrueObject, YawSymmetry};
pub use occupancy_score::{
    FreeSpaceScore, Occupancy, OccupancyScore, OccupancyScoreConfig, OccupancyScorer, OccupiedCell,
    OccupiedCellScore, SurfaceScore,
};
pub use plane_score::{
    DuplicatePlane, EstimatedPlane, FaceScore, FaceState, Facing, MergedPlane, PlaneMatch, PlaneScore,
    PlaneScoreConfig, score_planes,
};
pub use reference_cloud::{ReferenceCloud, ReferenceScore};
pub use spread::Spread;
pub use tracking_score::{
    IdentifiedBox, TrackingScore, TrackingScoreConfig, TrackingScoreError, TrackingScorer,
};
pub use truth::{Truth, TruthConfig};
