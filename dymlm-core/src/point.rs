/// A point of a cloud: x, y, z in metres, in the frame that its owner names.
pub type Point = [f32; 3];

/// A colour: red, green, blue.
pub type Rgb = [u8; 3];
