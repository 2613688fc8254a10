use dymlm_core::{BoundingBox, ConfigError, Mask, check_range};

use crate::parabola::vertex;
use crate::{Error, GrayImage};

/// Gradient products are averaged over a window of 2 radius + 1 pixels a side.
const WINDOW_RADIUS: usize = 2;
/// Settings of [`CornerDetector`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct CornerConfig {
    /// Largest number of corners in one image, 1..=100000, default 200.
    pub max_corners: usize,
    /// Least distance between corners, pixels, 1..=1000, default 7.
    pub min_distance: f32,
}

impl Default for CornerConfig {
    fn default() -> Self {
        Self { max_corners: 200, min_distance: 7.0 }
    }
}

impl CornerConfig {
    pub(crate) fn validate(&self) -> Result<(), ConfigError> {
        check_range("corners.max_corners", self.max_corners as f64, 1.0..=1e5)?;
        check_range("corners.min_distance", self.min_distance.into(), 1.0..=1000.0)
    }
}

/// A point whose motion can be measured in both image directions.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct Corner {
    /// Place in the image, pixels, interpolated by parabolas through the strengths.
    pub point: [f32; 2],
    /// The smaller eigenvalue of the mean gradient matrix around the point.
    pub strength: f32,
}

/// Finds corners: local maxima of the smaller eigenvalue of the gradient matrix.
///
/// Shi, Tomasi: "Good Features to Track", CVPR 1994. O(pixels of the region), and a comparison of each
/// local maximum with each corner that is stronger; working memory is reused.
///
/// ```
/// use dymlm_core::BoundingBox;
/// use dymlm_tracking::{CornerConfig, CornerDetector, GrayImage};
///
/// // A white quadrant whose corner is at (20, 12).
/// let value = |i: usize| if i % 64 >= 20 && i / 64 >= 12 { 1.0 } else { 0.0 };
/// let image = GrayImage::new(64, 48, (0..64 * 48).map(value).collect())?;
/// let mut detector = CornerDetector::new(&CornerConfig::default())?;
/// let corners = detector.detect(&image, BoundingBox::new(0.0, 0.0, 64.0, 48.0)?, None);
/// assert_eq!(corners.len(), 1);
/// let [u, v] = corners[0].point;
/// assert!((u - 20.0).abs() < 1.0 && (v - 12.0).abs() < 1.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct CornerDetector {
    config: CornerConfig,
    /// Products of gradients uu, uv, vv of each pixel, and their sums over the rows of the window.
    products: [Vec<f32>; 3],
    sums: [Vec<f32>; 3],
    strength: Vec<f32>,
    candidates: Vec<Corner>,
}

/// The part of the image that is searched.
#[derive(Debug, Clone, Copy)]
struct Region {
    first: [usize; 2],
    size: [usize; 2],
}

impl CornerDetector {
    /// Checks the settings.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(config: &CornerConfig) -> Result<Self, Error> {
        config.validate()?;
        Ok(Self {
            config: config.clone(),
            products: [const { Vec::new() }; 3],
            sums: [const { Vec::new() }; 3],
            strength: Vec::new(),
            candidates: Vec::new(),
        })
    }

    /// Corners in a region, strongest first, at pixels where the mask (of the image's size) is `true`.
    pub fn detect(&mut self, image: &GrayImage, region: BoundingBox, mask: Option<&Mask>) -> Vec<Corner> {
        let mut corners = Vec::new();
        self.detect_into(image, region, |u, v| mask.is_none_or(|mask| mask.at(u, v)), &mut corners);
        corners
    }

    /// As [`Self::detect`], into the caller's buffer, at pixels that `allowed(u, v)` accepts.
    pub fn detect_into(
        &mut self,
        image: &GrayImage,
        region: BoundingBox,
        allowed: impl Fn(usize, usize) -> bool,
        corners: &mut Vec<Corner>,
    ) {
        corners.clear();
        let (columns, rows) = (region.columns(image.width()), region.rows(image.height()));
        let region = Region { first: [columns.start, rows.start], size: [columns.len(), rows.len()] };
        if region.size[0] < 3 || region.size[1] < 3 {
            return;
        }
        self.measure_gradients(image, region);
        self.measure_strength(region);
        self.find_maxima(region, allowed);
        self.choose(corners);
    }

    fn measure_gradients(&mut self, image: &GrayImage, Region { first, size }: Region) {
        let count = size[0] * size[1];
        for plane in &mut self.products {
            // Columns at the image's border have no gradient, not that of the image before.
            plane.clear();
            plane.resize(count, 0.0);
        }
        let [uu, uv, vv] = &mut self.products;
        let targets =
            uu.chunks_exact_mut(size[0]).zip(uv.chunks_exact_mut(size[0])).zip(vv.chunks_exact_mut(size[0]));
        // The columns of the region that have neighbours on both sides in the image.
        let begin = first[0].max(1);
        let end = (first[0] + size[0]).min(image.width() - 1);
        let margin = begin - first[0];
        for (y, ((uu, uv), vv)) in targets.enumerate() {
            let v = (first[1] + y) as isize;
            let [above, here, below] = [v - 1, v, v + 1].map(|v| image.clamped_row(v));
            let [above, here, below] =
                [above, here, below].map(|row| row.get(begin - 1..=end).unwrap_or(&[]));
            let rows = above.windows(3).zip(here.windows(3)).zip(below.windows(3));
            let targets = uu.iter_mut().zip(uv.iter_mut()).zip(vv.iter_mut()).skip(margin);
            for (((uu, uv), vv), ((a, h), b)) in targets.zip(rows) {
                let gu = (3.0 * (a[2] - a[0] + b[2] - b[0]) + 10.0 * (h[2] - h[0])) / 32.0;
                let gv = (3.0 * (b[0] - a[0] + b[2] - a[2]) + 10.0 * (b[1] - a[1])) / 32.0;
                (*uu, *uv, *vv) = (gu * gu, gu * gv, gv * gv);
            }
        }
    }

    /// Computes the smaller eigenvalue of the mean gradient matrix of each pixel's window.
    fn measure_strength(&mut self, Region { size, .. }: Region) {
        let [width, height] = size;
        let radius = WINDOW_RADIUS;
        let norm = 1.0 / ((2 * radius + 1) * (2 * radius + 1)) as f32;
        self.strength.resize(width * height, 0.0);
        self.strength.fill(0.0);
        self.sums.iter_mut().for_each(|row| row.resize(width, 0.0));
        if 2 * radius >= width.min(height) {
            return;
        }
        for y in radius..height - radius {
            for (sums, products) in self.sums.iter_mut().zip(&self.products) {
                sums.fill(0.0);
                for row in products.chunks_exact(width).skip(y - radius).take(2 * radius + 1) {
                    sums.iter_mut().zip(row).for_each(|(sum, product)| *sum += product);
                }
            }
            let [uu, uv, vv] = &self.sums;
            let windows =
                uu.windows(2 * radius + 1).zip(uv.windows(2 * radius + 1)).zip(vv.windows(2 * radius + 1));
            let targets = self.strength[y * width + radius..].iter_mut();
            for (strength, ((uu, uv), vv)) in targets.zip(windows) {
                let [uu, uv, vv] = [uu, uv, vv].map(|window| norm * window.iter().sum::<f32>());
                *strength = 0.5 * (uu + vv - ((uu - vv) * (uu - vv) + 4.0 * uv * uv).sqrt());
            }
        }
    }

    /// Collects pixels that are stronger than the four neighbours before them, and at least as strong as the
    /// four after.
    fn find_maxima(&mut self, Region { first, size }: Region, allowed: impl Fn(usize, usize) -> bool) {
        self.candidates.clear();
        let [width, height] = size;
        // Maxima below a hundredth of the strongest are discarded as weak (a quality level, as in OpenCV).
        let strongest = self.strength.iter().copied().fold(0.0, f32::max);
        let least = 0.01 * strongest;
        for y in 1..height - 1 {
            for x in 1..width - 1 {
                let at = |dx: usize, dy: usize| self.strength[(y + dy - 1) * width + x + dx - 1];
                let here = at(1, 1);
                if here <= least {
                    continue;
                }
                let before = at(0, 0).max(at(1, 0)).max(at(2, 0)).max(at(0, 1));
                let after = at(2, 1).max(at(0, 2)).max(at(1, 2)).max(at(2, 2));
                let [u, v] = [first[0] + x, first[1] + y];
                if here > before && here >= after && allowed(u, v) {
                    let fraction = [vertex(at(0, 1), here, at(2, 1)), vertex(at(1, 0), here, at(1, 2))];
                    let point = [u as f32 + fraction[0], v as f32 + fraction[1]];
                    self.candidates.push(Corner { point, strength: here });
                }
            }
        }
        // Equal strengths keep the order of the image.
        self.candidates.sort_by(|a, b| b.strength.total_cmp(&a.strength));
    }

    /// Takes the strongest first, each at least `min_distance` away from all taken before. (Corners are too
    /// few for a grid to pay off.)
    fn choose(&self, corners: &mut Vec<Corner>) {
        let least = self.config.min_distance * self.config.min_distance;
        let is_far = |a: [f32; 2], b: [f32; 2]| {
            let [du, dv] = [a[0] - b[0], a[1] - b[1]];
            du * du + dv * dv >= least
        };
        for &candidate in &self.candidates {
            if corners.len() >= self.config.max_corners {
                return;
            }
            if corners.iter().all(|corner| is_far(corner.point, candidate.point)) {
                corners.push(candidate);
            }
        }
    }
}
