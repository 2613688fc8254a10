use std::ops::Range;

use dymlm_core::{BoundingBox, Frame, Mask, SensorModel};

/// Distance between samples, in pixels of a 640x480 image: a cat at 3 m has a dozen samples.
const SPACING: f64 = 8.0;
/// Least samples of a surface: three by two, more than noise gives.
const MIN_SAMPLES: usize = 6;

/// Finds the surfaces of an image that lie in space that was free for long.
///
/// The image is sampled on a grid; neighbouring samples in free space that lie on one surface form a new
/// surface. Flying pixels at the edges of things lie in free space too, so a sample counts only when the
/// readings around it are of the same surface.
///
/// Costs O(samples), some thousand per image, and at most one look-up in the map for each.
#[derive(Debug, Default)]
pub(super) struct NewSurfaces {
    spacing: usize,
    columns: usize,
    /// Depth of each sample in free space; 0 = none.
    depths: Vec<f32>,
    /// Samples of the current surface whose neighbours must still be visited, and their depths.
    front: Vec<(usize, f32)>,
    /// Pixels of all samples, surface by surface.
    pixels: Vec<[usize; 2]>,
    surfaces: Vec<NewSurface>,
}

/// A surface in space that was free for long.
#[derive(Debug, Clone)]
pub(super) struct NewSurface {
    /// The box around its samples, pixels.
    pub(super) bounding_box: BoundingBox,
    /// Its samples' range among those of all surfaces.
    samples: Range<usize>,
}

impl NewSurfaces {
    /// Finds the new surfaces among a frame's static pixels. `is_new` tells whether a place (camera's frame,
    /// metres) was free for long and nothing static is within a margin of it, metres.
    pub(super) fn find(
        &mut self,
        frame: &Frame,
        static_mask: &Mask,
        sensor: &SensorModel,
        is_new: impl Fn([f64; 3], f64) -> bool,
    ) {
        self.sample(frame, static_mask, sensor, is_new);
        self.surfaces.clear();
        self.pixels.clear();
        let pitch = self.spacing as f64 / frame.camera().fx().abs();
        for first in 0..self.depths.len() {
            if self.depths[first] > 0.0 {
                let surface = self.take_surface(first, |a, b| {
                    f64::from((a - b).abs()) <= sensor.tolerance(a.min(b), pitch * f64::from(a.min(b)))
                });
                self.surfaces.extend(surface);
            }
        }
        self.surfaces.sort_by_key(|surface| std::cmp::Reverse(surface.samples.len()));
    }

    /// The new surfaces of the frame, the largest first.
    pub(super) fn surfaces(&self) -> &[NewSurface] {
        &self.surfaces
    }

    /// Whether most of a surface is static in a mask.
    pub(super) fn is_static(&self, surface: &NewSurface, static_mask: &Mask) -> bool {
        let samples = self.pixels.get(surface.samples.clone()).unwrap_or(&[]);
        2 * samples.iter().filter(|[u, v]| static_mask.at(*u, *v)).count() > samples.len()
    }

    /// Stores the depth of each sample that lies on a surface in free space.
    fn sample(
        &mut self,
        frame: &Frame,
        static_mask: &Mask,
        sensor: &SensorModel,
        is_new: impl Fn([f64; 3], f64) -> bool,
    ) {
        let (camera, depth) = (frame.camera(), frame.depth());
        // At least three, so that each sample has a neighbouring pixel on every side.
        self.spacing = (SPACING * camera.size_scale()).round().max(3.0) as usize;
        self.columns = depth.width() / self.spacing;
        self.depths.clear();
        self.depths.resize(self.columns * (depth.height() / self.spacing), 0.0);
        let spacing = self.spacing;
        for (index, sample) in self.depths.iter_mut().enumerate() {
            let [u, v] = [index % self.columns, index / self.columns].map(|c| c * spacing + spacing / 2);
            let z = depth.at(u, v);
            if !sensor.is_used(z) || !static_mask.at(u, v) {
                continue;
            }
            let tolerance = sensor.tolerance(z, 0.0);
            let continues = |u: usize, v: usize| f64::from((depth.at(u, v) - z).abs()) <= tolerance;
            if !(continues(u - 1, v) && continues(u + 1, v) && continues(u, v - 1) && continues(u, v + 1)) {
                continue;
            }
            let place = camera.back_project([u as f64, v as f64], z.into());
            if is_new(place, tolerance) {
                *sample = z;
            }
        }
    }

    /// Collects the samples of the surface on which the sample at `first` lies; `None` when they are too few.
    fn take_surface(&mut self, first: usize, continues: impl Fn(f32, f32) -> bool) -> Option<NewSurface> {
        let (mut low, mut high, first_pixel) = ([usize::MAX; 2], [0; 2], self.pixels.len());
        self.front.clear();
        self.front.push((first, std::mem::take(&mut self.depths[first])));
        while let Some((sample, z)) = self.front.pop() {
            let cell = [sample % self.columns, sample / self.columns];
            self.pixels.push(cell.map(|c| self.middle(c)));
            for axis in 0..2 {
                low[axis] = low[axis].min(cell[axis]);
                high[axis] = high[axis].max(cell[axis]);
            }
            let columns = cell[0].saturating_sub(1)..(cell[0] + 2).min(self.columns);
            for row in cell[1].saturating_sub(1)..(cell[1] + 2).min(self.depths.len() / self.columns) {
                for neighbour in row * self.columns + columns.start..row * self.columns + columns.end {
                    if self.depths[neighbour] > 0.0 && continues(self.depths[neighbour], z) {
                        self.front.push((neighbour, std::mem::take(&mut self.depths[neighbour])));
                    }
                }
            }
        }
        // A sample's cell is the area nearer to it than to any other sample.
        let side = |cell: usize| (cell * self.spacing) as f32;
        let around = BoundingBox::new(side(low[0]), side(low[1]), side(high[0] + 1), side(high[1] + 1));
        let samples = first_pixel..self.pixels.len();
        if samples.len() < MIN_SAMPLES {
            self.pixels.truncate(first_pixel);
            return None;
        }
        Some(NewSurface { bounding_box: around.ok()?, samples })
    }

    /// The pixel of a sample's column or row.
    fn middle(&self, cell: usize) -> usize {
        cell * self.spacing + self.spacing / 2
    }
}
