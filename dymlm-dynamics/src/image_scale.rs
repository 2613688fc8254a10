/// The image width that settings in pixels are given for.
const REFERENCE_WIDTH: f32 = 640.0;

/// A number of pixels, given for an image 640 wide, in an image of `width` pixels.
pub(crate) fn scaled_pixels(pixels: f32, width: usize) -> usize {
    (pixels * width as f32 / REFERENCE_WIDTH).round() as usize
}
