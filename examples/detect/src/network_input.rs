use dymlm::core::{BoundingBox, ColorImage};

use crate::{Error, resize_bilinear};

/// The value with which YOLOX pads images in training.
const PADDING: f32 = 114.0;

/// How images of one size are placed in a network's input: scaled to fit with their proportions kept, at the
/// top left.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NetworkInput {
    image: [usize; 2],
    network: [usize; 2],
    /// Network pixels for each pixel of the image.
    scale: f64,
    scaled: [usize; 2],
}

impl NetworkInput {
    /// For images of `image` (width, height) pixels and a network with an input of `network` pixels.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`] when an image is so elongated that no pixel of its shorter side is left.
    pub(crate) fn new(image: [usize; 2], network: [usize; 2]) -> Result<Self, Error> {
        let ratio = |axis: usize| network[axis] as f64 / image[axis] as f64;
        let scale = ratio(0).min(ratio(1));
        // Rounded down, as YOLOX does.
        let scaled = image.map(|side| (side as f64 * scale) as usize);
        if scaled.contains(&0) {
            return Err(Error::ImageSize {
                width: image[0],
                height: image[1],
                network_width: network[0],
                network_height: network[1],
            });
        }
        Ok(Self { image, network, scale, scaled })
    }

    /// The network's input: blue, green and red one after the other, 0..=255, each row by row.
    pub(crate) fn planes(&self, image: &ColorImage) -> Vec<f32> {
        let scaled = resize_bilinear(image.data(), self.image, self.scaled);
        let [width, height] = self.network;
        let mut planes = vec![PADDING; 3 * width * height];
        for (plane, channel) in planes.chunks_exact_mut(width * height).zip([2, 1, 0]) {
            for (row, pixels) in plane.chunks_exact_mut(width).zip(scaled.chunks_exact(self.scaled[0])) {
                for (value, pixel) in row.iter_mut().zip(pixels) {
                    *value = f32::from(pixel[channel]);
                }
            }
        }
        planes
    }

    /// The part of a network's box that is on the image, in the image's pixels; `None` when the box is in the
    /// padding.
    pub(crate) fn box_in_image(&self, bounding_box: BoundingBox) -> Option<BoundingBox> {
        let sides = <[f32; 4]>::from(bounding_box).map(|side| side / self.scale as f32);
        BoundingBox::try_from(sides).ok()?.clipped(self.image[0], self.image[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wide_images_leave_padding_below_and_tall_ones_at_the_right() {
        let pixel = [10, 20, 30];
        for (size, inside, outside) in [([8, 4], 7 + 3 * 8, 4 * 8), ([2, 4], 3 + 7 * 8, 4)] {
            let image = ColorImage::new(size[0], size[1], vec![pixel; size[0] * size[1]]).unwrap();
            let planes = NetworkInput::new(size, [8, 8]).unwrap().planes(&image);
            assert_eq!([0, 64, 128].map(|plane| planes[plane + inside]), [30.0, 20.0, 10.0], "blue first");
            assert_eq!([0, 64, 128].map(|plane| planes[plane + outside]), [114.0; 3]);
            let padded = planes.iter().filter(|&&value| value == 114.0).count();
            assert_eq!(padded, 3 * 32, "half of it");
        }
    }

    #[test]
    fn rows_and_columns_stay_rows_and_columns() {
        let colors: Vec<[u8; 3]> = (0..64).map(|index| [index, 100 + index, 200]).collect();
        let image = ColorImage::new(8, 8, colors.clone()).unwrap();
        let planes = NetworkInput::new([8, 8], [8, 8]).unwrap().planes(&image);
        for (index, color) in colors.iter().enumerate() {
            assert_eq!([128, 64, 0].map(|plane| planes[plane + index]), color.map(f32::from));
        }
    }

    #[test]
    fn boxes_come_back_to_the_image_and_end_at_its_border() {
        let input = NetworkInput::new([640, 480], [416, 416]).unwrap();
        let sides =
            |sides: [f32; 4]| input.box_in_image(BoundingBox::try_from(sides).unwrap()).map(<[f32; 4]>::from);
        assert_eq!(sides([6.5, 13.0, 65.0, 130.0]), Some([10.0, 20.0, 100.0, 200.0]));
        assert_eq!(sides([-9.0, -9.0, 999.0, 400.0]), Some([0.0, 0.0, 640.0, 480.0]));
        assert_eq!(sides([f32::MIN, 0.0, f32::MAX, 1.3]), None, "too large to be a place in the image");
        assert_eq!(sides([0.0, 313.0, 416.0, 416.0]), None, "in the padding");
    }

    #[test]
    fn images_of_which_nothing_would_be_left_are_refused() {
        let error = NetworkInput::new([10_000, 3], [416, 416]).unwrap_err();
        assert_eq!(error.to_string(), "an image of 10000x3 pixels cannot be scaled into 416x416");
        assert!(NetworkInput::new([416, 1], [416, 416]).is_ok());
    }
}
