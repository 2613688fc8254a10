//! The integration tests of the crate, one file for each subject. They are one program, which is linked once and runs
//! the tests of all files side by side.
#![allow(clippy::unreadable_literal, clippy::unwrap_used)]

mod images;
mod lenses;
mod mask;
mod pose;
mod symmetric_eigen3;
mod vocabulary;
