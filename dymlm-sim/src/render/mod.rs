//! From bodies to images: depth, colour, and what is seen where.

mod renderer;
mod shader;
mod view;

pub(crate) use renderer::{NOTHING, Rendering, render};
