//! The test whether two finite planes are one. See [`AssociationConfig`].

mod config;
mod contact;
mod criterion;
mod finite_plane;
mod partition;

pub use config::{AssociationConfig, Sides};
pub(crate) use criterion::{Agreement, Criterion};
pub(crate) use finite_plane::FinitePlane;
pub(crate) use partition::Partition;
