//! How far maps and masks are from the truth.

mod cell_grid;
mod cloud_score;
mod detector_statistics;
mod mask_score;
mod nearest;
mod reference_cloud;
mod surfaces;
mod swept_volume;
mod truth;
mod voxel_key;

pub use cloud_score::{CloudScore, score_cloud};
pub use detector_statistics::{
    DetectorFigures, DetectorStatistics, ExactView, FigureRow, SideFigures, SizeFigures,
};
pub use mask_score::MaskScore;
pub use reference_cloud::{ReferenceCloud, ReferenceScore};
pub use truth::{Truth, TruthConfig};
