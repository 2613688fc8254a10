use dymlm_core::{ColorImage, Rgb};

use crate::number_plane::{NumberPlane, PlaneBuffers};

/// Side of the square of pixels that share one brightness, and of the square that shares one chroma: at 2 m a
/// pixel is 4 mm wide, and a voxel of the cloud 10 mm.
const LUMA_SIDE: usize = 2;
const CHROMA_SIDE: usize = 4;
/// Steps of brightness and chroma, of 256: about a camera's error from frame to frame, so that the mean over
/// many frames shows no steps. A lower value takes more bytes (1: 25 kB more per frame), a higher value shows
/// bands where few frames have looked.
const STEP: i32 = 4;
/// Number of values of chroma, 0..=128; brightness has fewer, 0..=64.
const LEVELS: u32 = 129;

/// A colour image as it is stored: brightness for each square of 2x2 pixels, chroma for each square of 4x4,
/// in steps of 4 of 256.
///
/// The image that is restored [from it](Self::to_image) is mapped, so that a map that is built again has the
/// same colours.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct ReducedColors {
    size: [usize; 2],
    luma: Vec<u8>,
    /// Red minus blue, and green minus the mean of both.
    chroma: [Vec<u8>; 2],
}

impl ReducedColors {
    /// Reduces an image. O(pixels).
    pub fn of(image: &ColorImage) -> Self {
        let mut colors = Self::default();
        colors.refill(image);
        colors
    }

    /// [`Self::of`] in this one's buffers.
    pub(crate) fn refill(&mut self, image: &ColorImage) {
        let Self { size, luma, chroma: [red, green] } = self;
        *size = [image.width(), image.height()];
        [&mut *luma, &mut *red, &mut *green].into_iter().for_each(Vec::clear);
        let (mut mixed, mut squares, mut large) = (Vec::new(), Vec::new(), Vec::new());
        for rows in image.data().chunks(CHROMA_SIDE * size[0]) {
            means_into(rows, size[0], &mut mixed, &mut squares);
            luma.extend(squares.iter().map(|mean| {
                let [r, g, b] = mean.map(i32::from);
                quantized(r + 2 * g + b, 4) as u8
            }));
            means_into(&squares, size[0].div_ceil(LUMA_SIDE), &mut mixed, &mut large);
            // -64..=64 becomes 0..=128.
            let hue = |difference| (quantized(difference, 2) + 64) as u8;
            let channels = || large.iter().map(|mean| mean.map(i32::from));
            red.extend(channels().map(|[r, _, b]| hue(2 * (r - b))));
            green.extend(channels().map(|[r, g, b]| hue(2 * g - r - b)));
        }
    }

    /// The restored image, which is the one that is mapped.
    ///
    /// # Errors
    ///
    /// None for colours that [`Self::of`] has made.
    pub fn to_image(&self) -> Result<ColorImage, dymlm_core::Error> {
        self.to_image_in(Vec::new())
    }

    /// [`Self::to_image`] in a buffer that is no longer needed.
    pub(crate) fn to_image_in(&self, mut pixels: Vec<Rgb>) -> Result<ColorImage, dymlm_core::Error> {
        let [width, height] = self.size;
        let columns = [LUMA_SIDE, CHROMA_SIDE].map(|side| width.div_ceil(side));
        pixels.resize(width * height, [0; 3]);
        for (place, rows) in pixels.chunks_mut(LUMA_SIDE * width).enumerate() {
            let luma = &self.luma[place * columns[0]..][..columns[0]];
            let hues = place * LUMA_SIDE / CHROMA_SIDE * columns[1];
            let [red, green] = self.chroma.each_ref().map(|plane| &plane[hues..][..columns[1]]);
            let (first, others) = rows.split_at_mut(width);
            let squares = first.chunks_mut(CHROMA_SIDE).zip(luma.chunks(CHROMA_SIDE / LUMA_SIDE));
            for ((pixels, luma), (&red, &green)) in squares.zip(red.iter().zip(green)) {
                // Both of whole squares at once: lengths that are known cost no look at them.
                if let (Ok(pixels), Ok(&[left, right])) =
                    (<&mut [Rgb; CHROMA_SIDE]>::try_from(&mut *pixels), <&[u8; 2]>::try_from(luma))
                {
                    let [left, right] = [left, right].map(|luma| color_of(luma, red, green));
                    *pixels = [left, left, right, right];
                } else {
                    for (pixels, &luma) in pixels.chunks_mut(LUMA_SIDE).zip(luma) {
                        pixels.fill(color_of(luma, red, green));
                    }
                }
            }
            others.chunks_mut(width).for_each(|row| row.copy_from_slice(first));
        }
        ColorImage::new(width, height, pixels)
    }

    /// Appends the colours to `out`.
    pub(crate) fn put(&self, buffers: &mut PlaneBuffers, out: &mut Vec<u8>) {
        let planes =
            [(&self.luma, LUMA_SIDE), (&self.chroma[0], CHROMA_SIDE), (&self.chroma[1], CHROMA_SIDE)];
        for (values, side) in planes {
            plane(self.size[0].div_ceil(side)).put(values.iter().copied().map(u32::from), buffers, out);
        }
    }

    /// Reads the colours that were put; `None` when the bytes hold none.
    pub(crate) fn take(bytes: &mut &[u8], size: [usize; 2]) -> Option<Self> {
        let mut plane = |side: usize| take_plane(bytes, size.map(|length| length.div_ceil(side)));
        Some(Self { size, luma: plane(LUMA_SIDE)?, chroma: [plane(CHROMA_SIDE)?, plane(CHROMA_SIDE)?] })
    }
}

fn plane(width: usize) -> NumberPlane {
    NumberPlane { width, count: LEVELS, has_holes: false }
}

fn take_plane(bytes: &mut &[u8], [columns, rows]: [usize; 2]) -> Option<Vec<u8>> {
    let values = plane(columns).take(columns * rows, bytes)?;
    Some(values.into_iter().map(|value| value as u8).collect())
}

/// Makes `all` the mean colours of squares of 2x2 pixels, rounded; squares at the rim are smaller. `mixed` is a
/// buffer.
fn means_into(colors: &[Rgb], width: usize, mixed: &mut Vec<u8>, all: &mut Vec<Rgb>) {
    all.clear();
    for rows in colors.chunks(2 * width) {
        let (upper, lower) = rows.split_at(width);
        // A square with half the pixels has the mean of one that has each of them twice.
        let lower = if lower.is_empty() { upper } else { lower };
        mix(upper.as_flattened(), lower.as_flattened(), mixed);
        // Of each two pixels the first is mixed with the one that belongs to it; the last second one is missing.
        mixed.extend(Rgb::default());
        all.extend(mixed.as_chunks::<6>().0.iter().map(|&[r, g, b, ..]| [r, g, b]));
        if let (false, Some(a), Some(c)) = (width.is_multiple_of(2), upper.last(), lower.last()) {
            all.push([0, 1, 2].map(|channel| mean_of([a[channel], a[channel], c[channel], c[channel]])));
        }
    }
}

/// Makes `mixed` the means of each channel, of the one to its right, and of those below both: without a branch or a
/// step, so that the compiler takes many at once.
fn mix(upper: &[u8], lower: &[u8], mixed: &mut Vec<u8>) {
    let length = upper.len().min(lower.len()).saturating_sub(size_of::<Rgb>());
    mixed.clear();
    mixed.resize(length, 0);
    let own = upper.iter().zip(lower);
    let right = upper.iter().zip(lower).skip(size_of::<Rgb>());
    for ((mixed, (&a, &c)), (&b, &d)) in mixed.iter_mut().zip(own).zip(right) {
        *mixed = mean_of([a, b, c, d]);
    }
}

#[inline]
fn mean_of(channels: [u8; 4]) -> u8 {
    ((channels.map(u16::from).iter().sum::<u16>() + 2) >> 2) as u8
}

/// value / parts in steps, rounded to the nearest step.
fn quantized(value: i32, parts: i32) -> i32 {
    let step = parts * STEP;
    (value + step / 2).div_euclid(step)
}

fn color_of(luma: u8, red: u8, green: u8) -> Rgb {
    let y = i32::from(luma) * STEP;
    let [red_blue, green_others] = [red, green].map(|hue| (i32::from(hue) - 64) * STEP);
    // y = (r + 2 g + b) / 4, red_blue = r - b, green_others = g - (r + b) / 2.
    let green = y + green_others / 2;
    let others = y - green_others / 2;
    [others + red_blue / 2, green, others - red_blue / 2].map(|channel| channel.clamp(0, 255) as u8)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: usize, height: usize, color: impl Fn(usize, usize) -> Rgb) -> ColorImage {
        let pixels = (0..width * height).map(|i| color(i % width, i / width)).collect();
        ColorImage::new(width, height, pixels).unwrap()
    }

    #[test]
    fn flat_colors_stay_within_two_steps() {
        for [width, height] in [[1, 1], [7, 5], [16, 12]] {
            for color in [[0, 0, 0], [255, 255, 255], [255, 0, 0], [0, 255, 0], [0, 0, 255], [90, 140, 33]] {
                let reduced = ReducedColors::of(&image(width, height, |_, _| color)).to_image().unwrap();
                for pixel in reduced.data() {
                    for channel in 0..3 {
                        let error = i32::from(pixel[channel]) - i32::from(color[channel]);
                        assert!(error.abs() <= 2 * STEP, "{pixel:?} for {color:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn means_are_those_of_the_pixels_that_are_there() {
        for [width, height] in [[1, 1], [2, 1], [1, 2], [7, 5], [12, 9]] {
            let image = image(width, height, |u, v| [(u * 37 + v) as u8, (u * v * 11) as u8, (v * 91) as u8]);
            let squares = (0..height).step_by(2).flat_map(|v| (0..width).step_by(2).map(move |u| (u, v)));
            let expected = squares.map(|(u, v)| {
                let rows = v..height.min(v + 2);
                let places = rows.flat_map(|v| (u..width.min(u + 2)).map(move |u| v * width + u));
                let pixels: Vec<Rgb> = places.map(|place| image.data()[place]).collect();
                [0, 1, 2].map(|channel| {
                    let sum: usize = pixels.iter().map(|pixel| usize::from(pixel[channel])).sum();
                    ((sum + pixels.len() / 2) / pixels.len()) as u8
                })
            });
            let mut means = Vec::new();
            means_into(image.data(), width, &mut Vec::new(), &mut means);
            assert_eq!(means, expected.collect::<Vec<_>>(), "{width} x {height}");
        }
    }

    #[test]
    fn packed_colors_come_back() {
        for [width, height] in [[1, 1], [7, 5], [33, 18]] {
            let colors = image(width, height, |u, v| [(u * 9) as u8, (v * 31) as u8, (u * v) as u8]);
            let reduced = ReducedColors::of(&colors);
            let mut bytes = Vec::new();
            reduced.put(&mut PlaneBuffers::default(), &mut bytes);
            let mut rest = bytes.as_slice();
            assert_eq!(ReducedColors::take(&mut rest, [width, height]), Some(reduced));
            assert!(rest.is_empty());
            assert_eq!(ReducedColors::take(&mut &bytes[1..], [width, height]), None);
        }
    }
}
