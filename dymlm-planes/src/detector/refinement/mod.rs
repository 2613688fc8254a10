//! The robust second fit of extracted planes. See [`PlaneRefiner`].

mod refiner;
mod reweighting;
mod runs;
mod stretch;

pub(super) use refiner::PlaneRefiner;
