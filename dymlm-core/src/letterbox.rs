use crate::pinhole_camera::{check_buffer, check_image_size};
use crate::{BoundingBox, Error, Mask};

/// How an image lies in a network's input: scaled to fit with its proportions kept, and centred between two
/// bars of padding, as YOLO networks are fed.
///
/// ```
/// use dymlm_core::{BoundingBox, Letterbox, Mask};
///
/// // YOLO-seg: boxes in pixels of 640x640, masks as 160x160 scores, here of an object in the left half.
/// let image = [1280, 720];
/// let found = BoundingBox::new(100.0, 200.0, 500.0, 400.0)?;
/// let found = Letterbox::centered(image, [640, 640])?.box_in_image(&found);
/// assert_eq!(<[f32; 4]>::from(found), [200.0, 120.0, 1000.0, 520.0]);
///
/// let scores: Vec<f32> = (0..160 * 160).map(|i| if i % 160 < 80 { 3.0 } else { -3.0 }).collect();
/// let mask = Mask::from_letterbox(&Letterbox::centered(image, [160, 160])?, &scores, 0.0, Some(&found))?;
/// assert!(mask.at(300, 300) && !mask.at(700, 300), "right of the object");
/// assert!(!mask.at(100, 300), "outside the box");
/// # Ok::<(), dymlm_core::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Letterbox {
    image: [usize; 2],
    network: [usize; 2],
    /// Network pixels per pixel of the image.
    scale: f64,
    /// Width of the left bar and height of the upper one, network pixels.
    padding: [f64; 2],
}

impl Letterbox {
    /// An image of `image` (width, height) pixels in the middle of an input of `network` pixels.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`] for either.
    pub fn centered(image: [usize; 2], network: [usize; 2]) -> Result<Self, Error> {
        check_image_size(image[0], image[1])?;
        check_image_size(network[0], network[1])?;
        let ratio = |axis: usize| network[axis] as f64 / image[axis] as f64;
        let scale = ratio(0).min(ratio(1));
        let padding = [0, 1].map(|axis| 0.5 * (network[axis] as f64 - image[axis] as f64 * scale));
        Ok(Self { image, network, scale, padding })
    }

    /// A box that the network gave, in pixels of the image.
    #[must_use]
    pub fn box_in_image(&self, bounding_box: &BoundingBox) -> BoundingBox {
        bounding_box.mapped(|sides| {
            let in_image = |side: f32, axis: usize| (f64::from(side) - self.padding[axis]) / self.scale;
            let [x_min, y_min, x_max, y_max] = sides;
            [in_image(x_min, 0), in_image(y_min, 1), in_image(x_max, 0), in_image(y_max, 1)]
                .map(|side| side as f32)
        })
    }

    /// For each pixel of the image along an axis, the two network pixels that it lies between, and how far
    /// towards the second one.
    fn taps(&self, axis: usize) -> Vec<(usize, usize, f32)> {
        let bar = (self.padding[axis] - 0.1).round().max(0.0) as usize;
        let other_bar = (self.padding[axis] + 0.1).round().max(0.0) as usize;
        let end = self.network[axis].saturating_sub(other_bar).max(bar + 1);
        let step = (end - bar) as f64 / self.image[axis] as f64;
        let tap = |pixel: usize| {
            let place = ((pixel as f64 + 0.5) * step - 0.5).clamp(0.0, (end - bar - 1) as f64);
            let first = place as usize;
            (bar + first, (bar + first + 1).min(end - 1), (place - first as f64) as f32)
        };
        (0..self.image[axis]).map(tap).collect()
    }
}

impl Mask {
    /// The instance mask of a network: `true` where its scores (one per network pixel, row by row),
    /// interpolated bilinearly between the bars of padding, are above `threshold` - 0 for logits, 0.5 for
    /// probabilities - and within the box, if one is given (in pixels of the image). O(pixels of the box).
    ///
    /// # Errors
    ///
    /// [`Error::BufferLength`] when there are not as many scores as network pixels.
    pub fn from_letterbox(
        letterbox: &Letterbox,
        scores: &[f32],
        threshold: f32,
        bounding_box: Option<&BoundingBox>,
    ) -> Result<Self, Error> {
        let ([width, height], [network_width, network_height]) = (letterbox.image, letterbox.network);
        check_buffer(network_width, network_height, scores.len())?;
        let (columns, rows) = (letterbox.taps(0), letterbox.taps(1));
        let rows_within = bounding_box.map_or(0..height, |area| area.rows(height));
        let columns_within = bounding_box.map_or(0..width, |area| area.columns(width));
        let mut mask = Self::filled(width, height, false)?;
        for v in rows_within {
            let (above, below, down) = rows[v];
            let [above, below] = [above, below].map(|row| &scores[row * network_width..][..network_width]);
            for u in columns_within.clone() {
                let (left, right, across) = columns[u];
                let along = |row: &[f32]| row[left] + (row[right] - row[left]) * across;
                let score = along(above) + (along(below) - along(above)) * down;
                mask.set(u, v, score > threshold);
            }
        }
        Ok(mask)
    }
}
