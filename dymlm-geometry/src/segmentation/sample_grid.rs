use std::ops::Range;

use dymlm_core::{BoundingBox, DepthImage, Frame, Mask, PinholeCamera, Point, SensorModel};

use super::SegmentationConfig;
use super::depth_scale::DepthRadius;

/// A box in a depth image, and which readings in and around it take part.
#[derive(Debug, Clone, Copy)]
pub struct BoxView<'a> {
    camera: &'a PinholeCamera,
    depth: &'a DepthImage,
    sensor: SensorModel,
    bounding_box: BoundingBox,
    static_mask: Option<&'a Mask>,
    instance_mask: Option<&'a Mask>,
}

impl<'a> BoxView<'a> {
    /// A box, pixels, with all readings in the sensor's range.
    pub fn new(frame: &'a Frame, sensor: &SensorModel, bounding_box: BoundingBox) -> Self {
        Self {
            camera: frame.camera(),
            depth: frame.depth(),
            sensor: *sensor,
            bounding_box,
            static_mask: None,
            instance_mask: None,
        }
    }

    /// Leaves out pixels that are not static (`false`).
    #[must_use]
    pub fn with_static_mask(mut self, mask: Option<&'a Mask>) -> Self {
        self.static_mask = mask;
        self
    }

    /// Leaves out pixels that the detector did not mark as the thing's (`false`).
    #[must_use]
    pub fn with_instance_mask(mut self, mask: Option<&'a Mask>) -> Self {
        self.instance_mask = mask;
        self
    }

    fn is_static(&self, u: usize, v: usize) -> bool {
        self.static_mask.is_none_or(|mask| mask.at(u, v))
    }

    fn is_instance(&self, u: usize, v: usize) -> bool {
        self.instance_mask.is_none_or(|mask| mask.at(u, v))
    }
}

/// Samples on a grid over a box and a margin around it
/// ([`BoxSegmenter::sample`](crate::BoxSegmenter::sample)), one per cell of `stride` pixels a side, at the
/// cell's middle pixel.
///
/// A buffer to reuse: filled again for each box, it allocates only to grow.
#[derive(Debug, Clone, Default)]
#[non_exhaustive]
pub struct SampleGrid {
    /// Pixels from one sample to the next.
    pub stride: usize,
    /// Number of cells side by side.
    pub columns: usize,
    /// Number of cells one above the other.
    pub rows: usize,
    /// Column and row of the first cell's first pixel.
    pub first: [usize; 2],
    /// The samples, row by row.
    pub samples: Vec<GridSample>,
    /// Cells in the box, with a sample or without.
    pub box_cells: usize,
    /// Share of the box that the static mask leaves out, 0..=1.
    pub masked_share: f32,
    /// Mean depth of the readings in the box that the static mask leaves out, metres.
    pub masked_depth: Option<f32>,
    /// The sample of each cell, row by row.
    cells: Vec<u32>,
    pub(super) radius: Option<DepthRadius>,
}

/// A reading of a [`SampleGrid`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct GridSample {
    /// Column of its cell.
    pub column: u32,
    /// Row of its cell.
    pub row: u32,
    /// In the camera frame, metres.
    pub point: Point,
    /// 1 at the centre of the box, 0 at its sides and outside. Towards a side that the image's border cuts,
    /// it stays as at the centre: the thing goes on beyond the border, and its own centre may be anywhere up
    /// to it.
    pub centrality: f32,
    /// Whether its pixel is in the box.
    pub is_in_box: bool,
    /// Whether its pixel is in the box or within the usual error of a detector's box around it.
    pub is_beside_box: bool,
    /// Whether the margin ends beside the sample, and the sample's surface goes on beyond.
    pub is_cut: bool,
}

/// No sample: what [`SampleGrid::sample_at`] returns for a cell without one.
pub const NO_SAMPLE: u32 = u32::MAX;

/// How far from a thing's end a detector's side usually is: 3 % of the box and a pixel.
const JITTER: f32 = 0.03;

impl SampleGrid {
    /// Lays the grid over a box and samples it.
    pub(super) fn fill(&mut self, view: &BoxView<'_>, config: &SegmentationConfig) {
        self.samples.clear();
        self.cells.clear();
        (self.columns, self.rows, self.stride, self.first) = (0, 0, 1, [0; 2]);
        (self.box_cells, self.masked_share, self.masked_depth) = (0, 0.0, None);
        self.radius = None;
        let camera = view.camera;
        let (width, height) = (camera.width(), camera.height());
        let scale = camera.size_scale() as f32;
        let margin = (config.margin_share * view.bounding_box.width().max(view.bounding_box.height()))
            .max(config.margin * scale);
        let Some(area) = widened(&view.bounding_box, margin, margin).clipped(width, height) else { return };
        let (columns, rows) = (area.columns(width), area.rows(height));
        let pixels = (columns.len() * rows.len()) as f64;
        let stride = (pixels / config.max_samples as f64).sqrt().ceil() as usize;
        self.stride = stride.max((config.spacing * scale).round() as usize).max(1);
        self.first = [columns.start, rows.start];
        self.columns = columns.len().div_ceil(self.stride);
        self.rows = rows.len().div_ceil(self.stride);
        self.cells.resize(self.columns * self.rows, NO_SAMPLE);
        let radius = DepthRadius {
            sensor: view.sensor,
            pitch: (self.stride as f64 / camera.fx().abs()) as f32,
            least: config.eps_depth,
        };
        self.radius = Some(radius);
        self.sample(view, &radius, scale, config.is_smoothed);
    }

    fn sample(&mut self, view: &BoxView<'_>, radius: &DepthRadius, scale: f32, is_smoothed: bool) {
        let (width, height) = (view.camera.width(), view.camera.height());
        let own = &view.bounding_box;
        let (columns_in, rows_in) = (own.columns(width), own.rows(height));
        let beside = widened(own, JITTER * own.width() + scale, JITTER * own.height() + scale);
        let (columns_beside, rows_beside) = (beside.columns(width), beside.rows(height));
        let [mut masked, mut masked_read, mut masked_depth] = [0.0_f32; 3];
        for row in 0..self.rows {
            let v = self.first[1] + row * self.stride + self.stride / 2;
            if v >= height {
                break;
            }
            let depths = view.depth.row(v);
            let down = centrality(v as f32, [own.y_min(), own.y_max()], height);
            for column in 0..self.columns {
                let u = self.first[0] + column * self.stride + self.stride / 2;
                let Some(&z) = depths.get(u) else { break };
                let is_static = view.is_static(u, v);
                let is_in_box = columns_in.contains(&u) && rows_in.contains(&v);
                if is_in_box {
                    self.box_cells += 1;
                    if !is_static {
                        masked += 1.0;
                        masked_read += f32::from(u8::from(z > 0.0));
                        masked_depth += z;
                    }
                }
                if !is_static || !view.sensor.is_used(z) || !view.is_instance(u, v) {
                    continue;
                }
                let point = if is_smoothed {
                    smoothed(view, [u, v], self.stride)
                } else {
                    view.camera.back_project([u as f64, v as f64], z.into()).map(|c| c as f32)
                };
                self.cells[row * self.columns + column] = self.samples.len() as u32;
                self.samples.push(GridSample {
                    column: column as u32,
                    row: row as u32,
                    point,
                    centrality: centrality(u as f32, [own.x_min(), own.x_max()], width) * down,
                    is_in_box,
                    is_beside_box: columns_beside.contains(&u) && rows_beside.contains(&v),
                    is_cut: self.is_cut(view, [column, row], z, radius),
                });
            }
        }
        self.masked_share = if self.box_cells > 0 { masked / self.box_cells as f32 } else { 0.0 };
        self.masked_depth = (masked_read > 0.0).then(|| masked_depth / masked_read);
    }

    /// Whether the grid ends beside a cell and the surface of depth `z` does not.
    fn is_cut(&self, view: &BoxView<'_>, [column, row]: [usize; 2], z: f32, radius: &DepthRadius) -> bool {
        let [u, v] = self.pixel(column, row);
        let stride = self.stride;
        let sides = [
            (column == 0, u.checked_sub(stride), Some(v)),
            (column + 1 == self.columns, Some(u + stride), Some(v)),
            (row == 0, Some(u), v.checked_sub(stride)),
            (row + 1 == self.rows, Some(u), Some(v + stride)),
        ];
        sides.into_iter().any(|(is_end, u, v)| {
            is_end
                && u.zip(v).is_some_and(|(u, v)| {
                    let beyond = view.depth.at(u, v);
                    beyond > 0.0 && (beyond - z).abs() <= radius.at(z)
                })
        })
    }

    /// The middle pixel of a cell, column and row.
    #[inline]
    pub fn pixel(&self, column: usize, row: usize) -> [usize; 2] {
        let middle = self.stride / 2;
        [self.first[0] + column * self.stride + middle, self.first[1] + row * self.stride + middle]
    }

    /// The index of a cell's sample; [`NO_SAMPLE`] when it has none or lies outside the grid.
    #[inline]
    pub fn sample_at(&self, column: i64, row: i64) -> u32 {
        let inside = (0..self.columns as i64).contains(&column) && (0..self.rows as i64).contains(&row);
        if inside { self.cells[row as usize * self.columns + column as usize] } else { NO_SAMPLE }
    }

    /// The box around some of the samples, pixels; `None` when there are none.
    pub fn bounds<'a>(&self, samples: impl IntoIterator<Item = &'a GridSample>) -> Option<BoundingBox> {
        let (mut low, mut high) = ([u32::MAX; 2], [0; 2]);
        for sample in samples {
            let cell = [sample.column, sample.row];
            low = [cell[0].min(low[0]), cell[1].min(low[1])];
            high = [cell[0].max(high[0]), cell[1].max(high[1])];
        }
        (low[0] <= high[0]).then(|| self.box_around(low, high)).flatten()
    }

    /// The box around the cells from `low` to `high`, pixels.
    pub(super) fn box_around(&self, low: [u32; 2], high: [u32; 2]) -> Option<BoundingBox> {
        let half = 0.5 * self.stride as f32;
        let [low, high] = [low, high].map(|[column, row]| self.pixel(column as usize, row as usize));
        let [left, top] = low.map(|c| c as f32 - half);
        let [right, bottom] = high.map(|c| c as f32 + half);
        BoundingBox::new(left, top, right, bottom).ok()
    }
}

/// A box with sides moved outward.
fn widened(own: &BoundingBox, x: f32, y: f32) -> BoundingBox {
    let sides = [own.x_min() - x, own.y_min() - y, own.x_max() + x, own.y_max() + y];
    BoundingBox::try_from(sides).unwrap_or(*own)
}

/// Mean of the readings around a pixel that the masks leave and that can be of its surface: it has their noise divided by three
/// or more, and no bias on slopes, since pixels are averaged with depths.
fn smoothed(view: &BoxView<'_>, [u, v]: [usize; 2], stride: usize) -> Point {
    let camera = view.camera;
    let (width, height) = (camera.width(), camera.height());
    let radius = if stride > 3 { 2 } else { 1 };
    let z = view.depth.at(u, v);
    let reach = 3.0 * view.sensor.sigma(z) + 2.0 * radius as f32 * z / camera.fx().abs() as f32;
    let around =
        |at: usize, size: usize| -> Range<usize> { at.saturating_sub(radius)..(at + radius + 1).min(size) };
    let [mut sum_u, mut sum_v, mut sum_z, mut count] = [0.0_f32; 4];
    for row in around(v, height) {
        let depths = view.depth.row(row);
        for column in around(u, width) {
            let other = depths[column];
            let is_asked = view.is_static(column, row) && view.is_instance(column, row);
            // Holes have no depth.
            if other > 0.0 && (other - z).abs() <= reach && is_asked {
                sum_u += column as f32;
                sum_v += row as f32;
                sum_z += other;
                count += 1.0;
            }
        }
    }
    let pixel = [f64::from(sum_u / count), f64::from(sum_v / count)];
    camera.back_project(pixel, f64::from(sum_z / count)).map(|c| c as f32)
}

/// A parabola over the extent of a box along one axis; constant from the centre to a side that the image
/// cuts.
fn centrality(at: f32, [low, high]: [f32; 2], image_size: usize) -> f32 {
    let x = (2.0 * at - low - high) / (high - low);
    let is_cut = if x < 0.0 { low <= 0.0 } else { high >= image_size as f32 };
    if is_cut { 1.0 } else { (1.0 - x * x).max(0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_an_instance_mask_leaves_out_is_in_no_mean() {
        let camera = PinholeCamera::new(20, 8, 20.0, 20.0, 9.5, 3.5).unwrap();
        // A thing on the left, and a wall close behind it.
        let depths = (0..160).map(|pixel| if pixel % 20 < 10 { 1.0 } else { 1.002 }).collect();
        let frame = Frame::new(0.0, camera, DepthImage::new(20, 8, depths).unwrap(), None).unwrap();
        let mask = Mask::new(20, 8, (0..160).map(|pixel| pixel % 20 < 10).collect()).unwrap();
        let (sensor, whole) = (SensorModel::kinect(), BoundingBox::new(0.0, 0.0, 20.0, 8.0).unwrap());
        let view = BoxView::new(&frame, &sensor, whole);
        assert!(smoothed(&view, [9, 4], 1)[2] > 1.0);
        assert_eq!(smoothed(&view.with_instance_mask(Some(&mask)), [9, 4], 1)[2], 1.0);
    }

    #[test]
    fn a_box_is_level_towards_the_side_that_the_image_cuts() {
        let inside = |at| centrality(at, [100.0, 200.0], 640);
        assert_eq!([inside(100.0), inside(150.0), inside(175.0), inside(200.0)], [0.0, 1.0, 0.75, 0.0]);
        let cut = |at| centrality(at, [540.0, 640.0], 640);
        assert_eq!([cut(540.0), cut(565.0), cut(600.0), cut(639.0)], [0.0, 0.75, 1.0, 1.0]);
        let cut = |at| centrality(at, [-20.0, 80.0], 640);
        assert_eq!([cut(0.0), cut(30.0), cut(80.0)], [1.0, 1.0, 0.0]);
    }
}
