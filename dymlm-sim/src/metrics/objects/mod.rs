//! The labelled objects of the true world.

mod object_truth;
mod surface_samples;
mod true_object;

pub(super) use object_truth::ObjectTruth;
pub use true_object::{TrueObject, YawSymmetry};
