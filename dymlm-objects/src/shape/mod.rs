//! What stands for an object in space, and how it looks in an image.

mod dual_quadric;
mod image_ellipse;
mod object_shape;

pub use dual_quadric::DualQuadric;
pub use image_ellipse::ImageEllipse;
pub use object_shape::ObjectShape;
