use crate::GrayImage;

/// Largest number of levels of a pyramid: in the last one, the largest allowed image is a few pixels wide.
const MOST_LEVELS: usize = 16;

/// An image and its halves. Level k is 2^k times smaller; each level smooths the one before by the binomial
/// filter 1 4 6 4 1 and takes every other pixel (Burt, Adelson 1983). Pixel (u, v) of a level lies on (2u,
/// 2v) of the level before.
///
/// O(pixels); [`Self::build`] into a pyramid of the same size does not allocate.
///
/// ```
/// use dymlm_tracking::{GrayImage, ImagePyramid};
///
/// let pyramid = ImagePyramid::new(&GrayImage::new(65, 48, vec![0.5; 65 * 48])?, 3);
/// let sizes: Vec<_> = pyramid.levels().iter().map(|level| (level.width(), level.height())).collect();
/// assert_eq!(sizes, [(65, 48), (33, 24), (17, 12), (9, 6)]);
/// # Ok::<(), dymlm_tracking::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct ImagePyramid {
    levels: Vec<GrayImage>,
    blended: Vec<f32>,
}

impl ImagePyramid {
    /// A pyramid of the image and `halvings` (at most 15) smaller levels.
    pub fn new(image: &GrayImage, halvings: usize) -> Self {
        let mut pyramid = Self::empty(halvings);
        pyramid.build(image);
        pyramid
    }

    /// A pyramid to be filled by [`Self::build`].
    pub fn empty(halvings: usize) -> Self {
        let levels = halvings.saturating_add(1).min(MOST_LEVELS);
        Self { levels: vec![GrayImage::empty(); levels], blended: Vec::new() }
    }

    /// Fills the pyramid from another image.
    pub fn build(&mut self, image: &GrayImage) {
        if let Some(base) = self.levels.first_mut() {
            base.copy_from(image);
        }
        self.build_halves();
    }

    /// Fills the pyramid from the luma of a colour image.
    pub fn build_from_color(&mut self, color: &dymlm_core::ColorImage) {
        if let Some(base) = self.levels.first_mut() {
            base.assign_color(color);
        }
        self.build_halves();
    }

    /// All levels, from the image itself down to the smallest. A side of one pixel is not halved further.
    pub fn levels(&self) -> &[GrayImage] {
        &self.levels
    }

    /// The image itself.
    pub fn base(&self) -> &GrayImage {
        // The first level always exists.
        &self.levels[0]
    }

    fn build_halves(&mut self) {
        for level in 1..self.levels.len() {
            let (finer, coarser) = self.levels.split_at_mut(level);
            if let (Some(source), Some(target)) = (finer.last(), coarser.first_mut()) {
                halve(source, target, &mut self.blended);
            }
        }
    }
}

/// Smooths the image and takes every other pixel of every other row; borders are repeated.
fn halve(source: &GrayImage, target: &mut GrayImage, blended: &mut Vec<f32>) {
    let [width, height] = [source.width().div_ceil(2), source.height().div_ceil(2)];
    target.resize(width, height);
    // Two repeated pixels at each end let the horizontal pass treat all pixels alike.
    blended.resize(source.width() + 5, 0.0);
    for (v, row) in target.data_mut().chunks_exact_mut(width.max(1)).enumerate() {
        let v = 2 * v as isize;
        let [a, b, c, d, e] = [-2, -1, 0, 1, 2].map(|offset| source.clamped_row(v + offset));
        let columns = a.iter().zip(b).zip(c).zip(d).zip(e);
        for (sum, ((((a, b), c), d), e)) in blended.iter_mut().skip(2).zip(columns) {
            *sum = 0.0625 * (a + e) + 0.25 * (b + d) + 0.375 * c;
        }
        let end = source.width() + 1;
        let (left, right) = (blended[2], blended[end]);
        blended[..2].fill(left);
        blended[end + 1..].fill(right);
        for (value, taps) in row.iter_mut().zip(blended.windows(5).step_by(2)) {
            *value = 0.0625 * (taps[0] + taps[4]) + 0.25 * (taps[1] + taps[3]) + 0.375 * taps[2];
        }
    }
}
