//! The mask of static pixels.

mod body_mask;
mod claimed_parts;
mod mask_config;
mod silhouette;
mod static_mask_builder;
mod still_parts;

pub(crate) use body_mask::mask_body;
pub use mask_config::{MaskConfig, MaskMode};
pub(crate) use static_mask_builder::{MaskRegion, StaticMaskBuilder};
pub(crate) use still_parts::ComparedFrame;
