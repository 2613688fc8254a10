//! Conversions to and from other math crates, one file and one feature for each major version.

#[cfg(feature = "glam_0_33")]
mod glam_0_33;
#[cfg(feature = "mint_0_5")]
mod mint_0_5;
#[cfg(feature = "nalgebra_0_35")]
mod nalgebra_0_35;
