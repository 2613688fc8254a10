//! A chosen object that is moved by hand: where it is, in six degrees of freedom.

mod config;
mod hiding;
mod model;
mod motion;
mod recovery;
mod silhouette;
mod state;
mod surface;
mod tracker;
mod view;

pub use config::ObjectTrackerConfig;
pub use model::{ObjectModel, SurfacePoint};
pub use state::{ObjectState, RestReport};
pub use tracker::{ObjectTracker, ObjectUpdate};
