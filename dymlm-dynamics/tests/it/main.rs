//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::print_stdout, clippy::unwrap_used)]

mod detector_rate;
mod kalman;
mod kitchen_people;
mod many_detections;
mod mot;
mod still_parts;
mod tracker;
mod turning_camera;
mod unlabelled;
mod walking_slab;
