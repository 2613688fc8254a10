//! The mask of static pixels.

mod mask_config;
mod silhouette;
mod static_mask_builder;

pub use mask_config::{MaskConfig, MaskMode};
pub use static_mask_builder::{MaskRegion, StaticMaskBuilder};
