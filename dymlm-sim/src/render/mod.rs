//! Renders bodies to images: depth, colour, and the body that each pixel shows.

mod renderer;
mod shader;
mod view;

pub(crate) use renderer::{NOTHING, Rendering, render};
