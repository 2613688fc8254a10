//! The shape that represents an object, and its outline in an image.

mod dual_quadric;
mod image_ellipse;
mod object_shape;

pub use dual_quadric::DualQuadric;
pub use image_ellipse::ImageEllipse;
pub use object_shape::ObjectShape;
