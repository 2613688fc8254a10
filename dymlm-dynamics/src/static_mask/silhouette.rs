use std::ops::Range;

use dymlm_core::{BoundingBox, DepthImage, Mask};

use super::MaskRegion;
use super::claimed_parts::ClaimedParts;
use super::still_parts::{ComparedFrame, StillParts, Stillness};
use crate::Foreground;

/// The pixels of one mover in its box.
///
/// The box is copied with a border of one pixel around it, so that no step has to check whether a neighbour
/// exists.
#[derive(Debug, Clone, Default)]
pub(super) struct Silhouette {
    columns: Range<usize>,
    rows: Range<usize>,
    /// Depths of the box and its border; 0 = no reading.
    depths: Vec<f32>,
    pixels: Vec<Pixel>,
    /// Pixels whose neighbours are visited now, and those for the next layer.
    front: Vec<usize>,
    next_front: Vec<usize>,
    at_edge: Vec<bool>,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Pixel {
    /// Part of the mover.
    Inside,
    /// Not (yet) part of the mover.
    Outside,
    /// On a plane that continues outside the box: part of the mover only when the detector's own mask says
    /// so, or as part of its rim.
    Background,
    /// Between a moving and a still part: masked, but not surely part of the mover.
    Doubtful,
    /// The border: not part of the box.
    Border,
}

impl Pixel {
    /// Whether the pixel is in the box and not yet part of the mover.
    #[inline]
    fn can_be_rim(self) -> bool {
        matches!(self, Self::Outside | Self::Background)
    }
}

impl Silhouette {
    /// Finds the mover's pixels in its box, without a rim.
    pub(super) fn trace(&mut self, mover: &MaskRegion<'_>, depth: &DepthImage) {
        self.columns = mover.bounding_box.columns(depth.width());
        self.rows = mover.bounding_box.rows(depth.height());
        self.copy_box(depth);
        self.exclude_background(mover.foreground);
        self.take_surface(mover.foreground);
        self.take_instance(mover.instance_mask);
        self.grow(mover.foreground);
    }

    /// Leaves out the parts that have been still while the mover moved.
    pub(super) fn release_still_parts(&mut self, compared: &ComparedFrame<'_>, parts: &mut StillParts) {
        let is_inside = |u: usize, v: usize| {
            let is_in = self.columns.contains(&u) && self.rows.contains(&v);
            is_in && self.pixels[self.index(u - self.columns.start, v - self.rows.start)] == Pixel::Inside
        };
        if !parts.find(compared, [self.columns.clone(), self.rows.clone()], is_inside) {
            return;
        }
        for ([columns, rows], stillness) in parts.released() {
            let pixel = match stillness {
                Stillness::Still => Pixel::Outside,
                Stillness::Doubtful => Pixel::Doubtful,
            };
            for row in within(&rows, &self.rows) {
                for column in within(&columns, &self.columns) {
                    let index = self.index(column, row);
                    if self.pixels[index] == Pixel::Inside {
                        self.pixels[index] = pixel;
                    }
                }
            }
        }
        self.collect_next_front();
    }

    /// Leaves out [other things' parts](ClaimedParts): beyond the mover's own box, which is not corrected, and
    /// where other things were detected (`claimed`).
    pub(super) fn release_claimed_parts(
        &mut self,
        own: &BoundingBox,
        claimed: &Mask,
        compared: &ComparedFrame<'_>,
        parts: &mut ClaimedParts,
    ) {
        let own = [own.columns(claimed.width()), own.rows(claimed.height())];
        let window = [self.columns.clone(), self.rows.clone()];
        if !parts.find(compared, window, |u, v| self.is_claimed(u, v, &own, claimed)) {
            return;
        }
        for [columns, rows] in parts.released() {
            // Up to the edge of the thing, seldom that of a block: from what is left the rim grows back.
            let half = columns.len() / 2;
            for v in rows.start.saturating_sub(half)..rows.end + half {
                for u in columns.start.saturating_sub(half)..columns.end + half {
                    if self.is_claimed(u, v, &own, claimed) {
                        let index = self.index(u - self.columns.start, v - self.rows.start);
                        self.pixels[index] = Pixel::Outside;
                    }
                }
            }
        }
        self.collect_next_front();
    }

    /// Whether a pixel of the mover is claimed by other things, and is not in the mover's own detected box.
    fn is_claimed(&self, u: usize, v: usize, own: &[Range<usize>; 2], claimed: &Mask) -> bool {
        self.columns.contains(&u)
            && self.rows.contains(&v)
            && !(own[0].contains(&u) && own[1].contains(&v))
            && claimed.at(u, v)
            && self.pixels[self.index(u - self.columns.start, v - self.rows.start)] == Pixel::Inside
    }

    /// Fills `next_front` with the mover's pixels that have a neighbour outside it.
    fn collect_next_front(&mut self) {
        self.collect_front();
        std::mem::swap(&mut self.front, &mut self.next_front);
    }

    /// Makes the mover's pixels `false`.
    pub(super) fn remove_from(&self, is_static: &mut Mask) {
        for (row, v) in self.rows.clone().enumerate() {
            let pixels = &self.pixels[self.index(0, row)..][..self.columns.len()];
            let mut first = self.columns.start;
            for stretch in pixels.chunk_by(|a, b| a == b) {
                if matches!(stretch.first(), Some(Pixel::Inside | Pixel::Doubtful)) {
                    is_static.fill_row(v, first..first + stretch.len(), false);
                }
                first += stretch.len();
            }
        }
    }

    /// Width of the box and its border.
    fn stride(&self) -> usize {
        self.columns.len() + 2
    }

    /// Index of a pixel of the box, counted from its corner.
    fn index(&self, column: usize, row: usize) -> usize {
        (row + 1) * self.stride() + column + 1
    }

    fn copy_box(&mut self, depth: &DepthImage) {
        let size = self.stride() * (self.rows.len() + 2);
        self.depths.clear();
        self.depths.resize(size, 0.0);
        self.pixels.clear();
        self.pixels.resize(size, Pixel::Border);
        for (row, v) in self.rows.clone().enumerate() {
            let start = self.index(0, row);
            let end = start + self.columns.len();
            self.depths[start..end].copy_from_slice(&depth.row(v)[self.columns.clone()]);
            self.pixels[start..end].fill(Pixel::Outside);
        }
    }

    /// Keeps floors and walls out.
    fn exclude_background(&mut self, foreground: &Foreground) {
        for cell in foreground.background_cells() {
            let columns = within(&cell.columns, &self.columns);
            for row in within(&cell.rows, &self.rows) {
                for column in columns.clone() {
                    let index = self.index(column, row);
                    let (u, v) = (column + self.columns.start, row + self.rows.start);
                    let z = self.depths[index];
                    if z > 0.0 && cell.planes.hold(u, v, z) {
                        self.pixels[index] = Pixel::Background;
                    }
                }
            }
        }
    }

    /// Starts with the pixels on the foreground's surface.
    fn take_surface(&mut self, foreground: &Foreground) {
        for patch in foreground.patches() {
            let columns = within(&patch.columns, &self.columns);
            for row in within(&patch.rows, &self.rows) {
                for column in columns.clone() {
                    let index = self.index(column, row);
                    if patch.holds(self.depths[index]) && self.pixels[index] == Pixel::Outside {
                        self.pixels[index] = Pixel::Inside;
                    }
                }
            }
        }
    }

    /// Adds the detector's own mask.
    fn take_instance(&mut self, instance_mask: Option<&Mask>) {
        let Some(mask) = instance_mask else { return };
        for (row, v) in self.rows.clone().enumerate() {
            for (column, u) in self.columns.clone().enumerate() {
                if mask.at(u, v) {
                    let index = self.index(column, row);
                    self.pixels[index] = Pixel::Inside;
                }
            }
        }
    }

    /// Adds neighbours that continue the surface until there are no more. Afterwards `next_front` holds all
    /// pixels of the mover that may have a neighbour outside it.
    fn grow(&mut self, foreground: &Foreground) {
        self.collect_front();
        self.next_front.clear();
        while let Some(pixel) = self.front.pop() {
            let z = self.depths[pixel];
            for neighbour in self.neighbours(pixel) {
                // A reading of 0 continues nothing.
                let z_neighbour = self.depths[neighbour];
                if self.pixels[neighbour] == Pixel::Outside
                    && foreground.continues(z, z_neighbour)
                    && foreground.reaches(z_neighbour)
                {
                    self.pixels[neighbour] = Pixel::Inside;
                    self.front.push(neighbour);
                }
            }
            if self.neighbours(pixel).into_iter().any(|n| self.pixels[n].can_be_rim()) {
                self.next_front.push(pixel);
            }
        }
    }

    /// Marks the mover's pixels that lie in a box.
    pub(super) fn add_to(&self, bounding_box: &BoundingBox, is_mover: &mut Mask) {
        let columns = within(&bounding_box.columns(is_mover.width()), &self.columns);
        for row in within(&bounding_box.rows(is_mover.height()), &self.rows) {
            let pixels = &self.pixels[self.index(columns.start, row)..][..columns.len()];
            let mut first = self.columns.start + columns.start;
            for stretch in pixels.chunk_by(|a, b| a == b) {
                if stretch.first() == Some(&Pixel::Inside) {
                    is_mover.fill_row(row + self.rows.start, first..first + stretch.len(), true);
                }
                first += stretch.len();
            }
        }
    }

    /// Adds layers of pixels around the silhouette: all pixels in the first `dilation` layers, then up to
    /// layer `shadow` only those without depth.
    pub(super) fn add_rim(&mut self, dilation: usize, shadow: usize) {
        for layer in 0..shadow {
            std::mem::swap(&mut self.front, &mut self.next_front);
            self.next_front.clear();
            for &pixel in &self.front {
                for neighbour in self.neighbours(pixel) {
                    let joins = layer < dilation || self.depths[neighbour] == 0.0;
                    if joins && self.pixels[neighbour].can_be_rim() {
                        self.pixels[neighbour] = Pixel::Inside;
                        self.next_front.push(neighbour);
                    }
                }
            }
        }
    }

    /// Fills `front` with the mover's pixels that have a neighbour outside it.
    #[allow(clippy::needless_bitwise_bool, reason = "without branches sixteen pixels are compared at once")]
    fn collect_front(&mut self) {
        self.front.clear();
        let (stride, width) = (self.stride(), self.columns.len());
        self.at_edge.resize(width, false);
        for row in 0..self.rows.len() {
            let start = self.index(0, row);
            let line = |from: usize| &self.pixels[from..from + width];
            let (pixels, left, right) = (line(start), line(start - 1), line(start + 1));
            let (above, below) = (line(start - stride), line(start + stride));
            for i in 0..width {
                let open = left[i].can_be_rim()
                    | right[i].can_be_rim()
                    | above[i].can_be_rim()
                    | below[i].can_be_rim();
                self.at_edge[i] = (pixels[i] == Pixel::Inside) & open;
            }
            for (chunk, flags) in self.at_edge.chunks(16).enumerate() {
                if flags.contains(&true) {
                    let first = start + 16 * chunk;
                    self.front
                        .extend(flags.iter().enumerate().filter_map(|(i, &edge)| edge.then_some(first + i)));
                }
            }
        }
    }

    /// The pixels left, right, above and below one of the box.
    fn neighbours(&self, pixel: usize) -> [usize; 4] {
        [pixel - 1, pixel + 1, pixel - self.stride(), pixel + self.stride()]
    }
}

/// The part of `range` in `window`, counted from the window's start.
fn within(range: &Range<usize>, window: &Range<usize>) -> Range<usize> {
    let start = range.start.max(window.start) - window.start;
    let end = range.end.min(window.end).saturating_sub(window.start);
    start..end.max(start)
}
