use std::ops::Range;

use dymlm_core::{BoundingBox, ConfigError, DepthImage, Mask, check_range};

use crate::image_scale::scaled_pixels;
use crate::{Error, Foreground};

/// What of a mover's box is masked.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum MaskMode {
    /// Everything inside the corrected box, as in the paper.
    Box,
    /// Only the pixels connected in depth to the foreground, and a rim.
    #[default]
    Silhouette,
}

/// Settings of [`StaticMaskBuilder`].
#[derive(Debug, Clone, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(default, deny_unknown_fields))]
#[non_exhaustive]
pub struct MaskConfig {
    /// What of a box is masked; default [`MaskMode::Silhouette`].
    pub mode: MaskMode,
    /// Width of the rim masked around a silhouette, in pixels of an image 640 wide (other images: in proportion);
    /// 0..=64, default 3: depth edges lie one to three pixels off colour edges on a Kinect.
    pub dilation: f32,
    /// Width of the rim where it has no depth, in the same pixels; 0..=64, default 8: the shadow at the side of a
    /// structured-light silhouette. Never less than `dilation`.
    pub shadow: f32,
}

impl Default for MaskConfig {
    fn default() -> Self {
        Self { mode: MaskMode::default(), dilation: 3.0, shadow: 8.0 }
    }
}

impl MaskConfig {
    fn validate(&self) -> Result<(), ConfigError> {
        check_range("mask.dilation", self.dilation.into(), 0.0..=64.0)?;
        check_range("mask.shadow", self.shadow.into(), 0.0..=64.0)
    }
}

/// One mover to be masked.
#[derive(Debug, Clone, Copy)]
pub struct MaskRegion<'a> {
    /// Its corrected box, pixels.
    pub bounding_box: BoundingBox,
    /// Its foreground. When it is empty, the whole box is masked.
    pub foreground: &'a Foreground,
    /// The detector's instance mask: all its pixels in the box are masked.
    pub instance_mask: Option<&'a Mask>,
}

/// Builds the mask of static pixels: paper section III-A.
///
/// In [`MaskMode::Silhouette`] the pixels on the foreground's surface are taken; from them the silhouette grows over
/// neighbours that continue the surface in depth and lie within the foreground's range of depths; then a rim is
/// added, wider where there is no depth. All of it stays within the corrected box, so the background between legs
/// and beside a head is kept.
///
/// Costs O(pixels in the boxes).
///
/// ```
/// use dymlm_core::{BoundingBox, DepthImage, Mask, PinholeCamera};
/// use dymlm_dynamics::*;
///
/// // Somebody at 2 m, before a wall at 3 m.
/// let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5)?;
/// let person = |u: usize| (60..100).contains(&u);
/// let depth = (0..160 * 120).map(|i| if person(i % 160) { 2.0 } else { 3.0 }).collect();
/// let depth = DepthImage::new(160, 120, depth)?;
/// let bounding_box = BoundingBox::new(50.0, 0.0, 110.0, 120.0)?;
///
/// let mut foreground = Foreground::new();
/// ForegroundFinder::new(ForegroundConfig::default())?.find(
///     &camera,
///     &depth,
///     &ForegroundSearch::new(bounding_box),
///     &mut foreground,
/// );
/// let mut is_static = Mask::filled(160, 120, true)?;
/// let mut builder = StaticMaskBuilder::new(MaskConfig::default())?;
/// builder.build([MaskRegion { bounding_box, foreground: &foreground, instance_mask: None }], &depth, &mut is_static);
/// assert!(!is_static.at(70, 60) && is_static.at(54, 60) && is_static.at(40, 60));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct StaticMaskBuilder {
    config: MaskConfig,
    /// Whether each pixel of the box belongs to the mover.
    inside: Vec<bool>,
    /// Pixels of the box whose neighbours are still to be looked at.
    front: Vec<usize>,
    next_front: Vec<usize>,
}

/// The pixels of a box, numbered row by row.
#[derive(Debug, Clone)]
struct Window {
    columns: Range<usize>,
    rows: Range<usize>,
}

impl StaticMaskBuilder {
    /// Makes a builder.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(config: MaskConfig) -> Result<Self, Error> {
        config.validate()?;
        Ok(Self { config, inside: Vec::new(), front: Vec::new(), next_front: Vec::new() })
    }

    /// Fills the mask: `true` = static, `false` = inside a mover. A mask of another size than the depth image is
    /// made anew.
    pub fn build<'a>(
        &mut self,
        movers: impl IntoIterator<Item = MaskRegion<'a>>,
        depth: &DepthImage,
        is_static: &mut Mask,
    ) {
        if (is_static.width(), is_static.height()) == (depth.width(), depth.height()) {
            is_static.data_mut().fill(true);
        } else if let Ok(fresh) = Mask::filled(depth.width(), depth.height(), true) {
            *is_static = fresh;
        }
        for mover in movers {
            let window = Window {
                columns: mover.bounding_box.columns(depth.width()),
                rows: mover.bounding_box.rows(depth.height()),
            };
            if window.columns.is_empty() || window.rows.is_empty() {
                continue;
            }
            if self.config.mode == MaskMode::Box || mover.foreground.is_empty() {
                remove_box(&window, is_static);
            } else {
                self.take_surface(&mover, depth, &window);
                self.grow(&mover, depth, &window);
                self.add_rim(depth, &window);
                self.remove_silhouette(&window, is_static);
            }
        }
    }

    /// Starts the silhouette with the pixels on the foreground's surface and those of the instance mask.
    fn take_surface(&mut self, mover: &MaskRegion<'_>, depth: &DepthImage, window: &Window) {
        self.inside.clear();
        for v in window.rows.clone() {
            let depths = depth.row(v).get(window.columns.clone()).unwrap_or(&[]);
            self.inside.extend(depths.iter().zip(window.columns.clone()).map(|(&z, u)| {
                let given = mover.instance_mask.is_some_and(|mask| mask.at(u, v));
                given || (z > 0.0 && mover.foreground.holds(u, v, z))
            }));
        }
        self.front.clear();
        self.front.extend(self.inside.iter().enumerate().filter_map(|(i, &inside)| inside.then_some(i)));
    }

    /// Adds neighbours that continue the surface, until there are none.
    fn grow(&mut self, mover: &MaskRegion<'_>, depth: &DepthImage, window: &Window) {
        while let Some(pixel) = self.front.pop() {
            let z = window.depth(depth, pixel);
            if z == 0.0 {
                continue;
            }
            for neighbour in window.neighbours(pixel).into_iter().flatten() {
                if self.inside[neighbour] {
                    continue;
                }
                let z_neighbour = window.depth(depth, neighbour);
                if z_neighbour > 0.0
                    && mover.foreground.continues(z, z_neighbour)
                    && mover.foreground.reaches(z_neighbour)
                {
                    self.inside[neighbour] = true;
                    self.front.push(neighbour);
                }
            }
        }
    }

    /// Adds layers of pixels around the silhouette: all pixels for `dilation` layers, from then on only those
    /// without depth.
    fn add_rim(&mut self, depth: &DepthImage, window: &Window) {
        let dilation = scaled_pixels(self.config.dilation, depth.width());
        let shadow = scaled_pixels(self.config.shadow, depth.width()).max(dilation);
        self.front.clear();
        self.front.extend(self.inside.iter().enumerate().filter_map(|(i, &inside)| inside.then_some(i)));
        for layer in 0..shadow {
            self.next_front.clear();
            for &pixel in &self.front {
                for neighbour in window.neighbours(pixel).into_iter().flatten() {
                    let joins = layer < dilation || window.depth(depth, neighbour) == 0.0;
                    if joins && !self.inside[neighbour] {
                        self.inside[neighbour] = true;
                        self.next_front.push(neighbour);
                    }
                }
            }
            std::mem::swap(&mut self.front, &mut self.next_front);
        }
    }

    fn remove_silhouette(&self, window: &Window, is_static: &mut Mask) {
        let width = is_static.width();
        let inside_rows = self.inside.chunks_exact(window.columns.len());
        for (v, inside) in window.rows.clone().zip(inside_rows) {
            let row = &mut is_static.data_mut()[v * width..][window.columns.clone()];
            for (pixel, &inside) in row.iter_mut().zip(inside) {
                *pixel &= !inside;
            }
        }
    }
}

fn remove_box(window: &Window, is_static: &mut Mask) {
    let width = is_static.width();
    for v in window.rows.clone() {
        is_static.data_mut()[v * width..][window.columns.clone()].fill(false);
    }
}

impl Window {
    fn depth(&self, depth: &DepthImage, pixel: usize) -> f32 {
        let width = self.columns.len();
        depth.at(self.columns.start + pixel % width, self.rows.start + pixel / width)
    }

    /// The pixels left, right, above and below.
    fn neighbours(&self, pixel: usize) -> [Option<usize>; 4] {
        let width = self.columns.len();
        let column = pixel % width;
        [
            (column > 0).then(|| pixel - 1),
            (column + 1 < width).then_some(pixel + 1),
            pixel.checked_sub(width),
            (pixel + width < width * self.rows.len()).then_some(pixel + width),
        ]
    }
}
