//! When two finite planes are one. See [`AssociationConfig`].

mod config;
mod contact;
mod criterion;
mod partition;

pub use config::{AssociationConfig, Sides};
pub(crate) use criterion::{Agreement, Criterion, FinitePlane};
pub(crate) use partition::Partition;
