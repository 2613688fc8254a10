//! Segmentation of the thing in a box by clusters of its readings.

mod box_cluster;
mod box_segmenter;
mod config;
mod depth_scale;
mod sample_grid;

pub use box_cluster::BoxCluster;
pub use box_segmenter::BoxSegmenter;
pub use config::SegmentationConfig;
pub use sample_grid::{BoxView, GridSample, NO_SAMPLE, SampleGrid};
