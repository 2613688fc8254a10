//! Tracks the pose, in six degrees of freedom, of a chosen object that is moved by hand.

mod config;
mod cut_out;
mod fit;
mod likely_places;
mod model;
mod motion;
mod occlusion;
mod pixel_lengths;
mod point_flow;
mod pose_fitter;
mod rest_watch;
mod scene;
mod search;
mod silhouette;
mod state;
mod surface;
mod surface_point;
mod tracker;
mod view;
mod view_store;

pub use config::ObjectTrackerConfig;
pub use model::{ObjectModel, SurfacePoint};
pub use state::{ObjectState, RestReport};
pub use tracker::{ObjectTracker, ObjectUpdate};
