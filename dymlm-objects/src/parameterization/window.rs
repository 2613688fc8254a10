use std::ops::Range;

use dymlm_core::{BoundingBox, Point, axial_noise};

use super::ParameterizationConfig;
use crate::ObjectView;

/// A grid of samples over a box and its surroundings.
#[derive(Debug, Default)]
pub(super) struct Window {
    pub(super) stride: usize,
    pub(super) columns: usize,
    pub(super) rows: usize,
    first: [usize; 2],
    /// The sample of each cell of the grid, row by row; `NONE` where there is none.
    cells: Vec<u32>,
    pub(super) samples: Vec<Sample>,
    /// Cells in the box.
    pub(super) box_cells: usize,
    /// Share of the box that movers hide, 0..=1.
    pub(super) hidden_share: f32,
    /// Mean depth of the movers in the box, metres.
    pub(super) mover_depth: Option<f32>,
}

/// A smoothed reading.
#[derive(Debug, Clone, Copy)]
pub(super) struct Sample {
    pub(super) column: u32,
    pub(super) row: u32,
    /// In the camera frame, metres.
    pub(super) point: Point,
    /// 1 at the centre of the box, 0 at its sides and outside.
    pub(super) centrality: f32,
    pub(super) is_in_box: bool,
    /// Within what a detector's box usually misses of a thing.
    pub(super) is_beside_box: bool,
}

/// No sample.
pub(super) const NONE: u32 = u32::MAX;

/// Least margin around a box, pixels.
const LEAST_MARGIN: f32 = 6.0;
/// How far from a side a detector's box usually is, as a share of the box and in pixels.
const JITTER: f32 = 0.03;
const JITTER_PIXELS: f32 = 1.0;

impl Window {
    /// Lays a grid over a detection's box and samples it.
    pub(super) fn fill(&mut self, view: &ObjectView<'_>, detection: usize, config: &ParameterizationConfig) {
        self.samples.clear();
        self.cells.clear();
        (self.columns, self.rows, self.stride) = (0, 0, 1);
        let Some(detection) = view.detections.get(detection) else { return };
        let bounding_box = detection.bounding_box();
        let camera = view.frame.camera();
        let Some(area) = widened(&bounding_box, config.margin).clipped(camera.width(), camera.height())
        else {
            return;
        };
        let (columns, rows) = (area.columns(camera.width()), area.rows(camera.height()));
        let pixels = columns.len() * rows.len();
        self.stride = ((pixels as f64 / config.max_samples as f64).sqrt().ceil() as usize).max(1);
        self.first = [columns.start, rows.start];
        self.columns = columns.len().div_ceil(self.stride);
        self.rows = rows.len().div_ceil(self.stride);
        self.cells.resize(self.columns * self.rows, NONE);
        self.sample(view, &bounding_box, detection.mask(), config);
    }

    fn sample(
        &mut self,
        view: &ObjectView<'_>,
        bounding_box: &BoundingBox,
        instance_mask: Option<&dymlm_core::Mask>,
        config: &ParameterizationConfig,
    ) {
        let (width, height) = (view.frame.camera().width(), view.frame.camera().height());
        let depths = view.frame.depth().data();
        let (columns_in, rows_in) = (bounding_box.columns(width), bounding_box.rows(height));
        let beside = jittered(bounding_box);
        let (columns_beside, rows_beside) = (beside.columns(width), beside.rows(height));
        let [mut in_box, mut hidden, mut hidden_read, mut hidden_depth] = [0.0_f32; 4];
        let [center_u, center_v] = bounding_box.center();
        let (half_width, half_height) = (0.5 * bounding_box.width(), 0.5 * bounding_box.height());
        let used = config.min_depth.max(f32::MIN_POSITIVE)..=config.max_depth;
        for row in 0..self.rows {
            for column in 0..self.columns {
                let [u, v] = self.pixel(column, row);
                if u >= width || v >= height {
                    continue;
                }
                let pixel = v * width + u;
                let outside = instance_mask.is_some_and(|mask| !mask.at(u, v));
                let is_in_box = columns_in.contains(&u) && rows_in.contains(&v);
                if is_in_box {
                    in_box += 1.0;
                    if !view.is_static(u, v) {
                        hidden += 1.0;
                        hidden_read += f32::from(u8::from(depths[pixel] > 0.0));
                        hidden_depth += depths[pixel];
                    }
                }
                if !used.contains(&depths[pixel]) || !view.is_static(u, v) || outside {
                    continue;
                }
                let across = parabola((u as f32 - center_u) / half_width);
                let down = parabola((v as f32 - center_v) / half_height);
                self.cells[row * self.columns + column] = self.samples.len() as u32;
                self.samples.push(Sample {
                    column: column as u32,
                    row: row as u32,
                    point: smoothed(view, [u, v], self.stride),
                    centrality: across * down,
                    is_in_box,
                    is_beside_box: columns_beside.contains(&u) && rows_beside.contains(&v),
                });
            }
        }
        self.box_cells = in_box as usize;
        self.hidden_share = if in_box > 0.0 { hidden / in_box } else { 0.0 };
        self.mover_depth = (hidden_read > 0.0).then(|| hidden_depth / hidden_read);
    }

    /// The pixel of a cell.
    #[inline]
    pub(super) fn pixel(&self, column: usize, row: usize) -> [usize; 2] {
        let middle = self.stride / 2;
        [self.first[0] + column * self.stride + middle, self.first[1] + row * self.stride + middle]
    }

    /// The sample of a cell; `NONE` when it has none or lies outside.
    #[inline]
    pub(super) fn sample_at(&self, column: i64, row: i64) -> u32 {
        let inside = (0..self.columns as i64).contains(&column) && (0..self.rows as i64).contains(&row);
        if inside { self.cells[row as usize * self.columns + column as usize] } else { NONE }
    }
}

fn widened(own: &BoundingBox, share: f32) -> BoundingBox {
    let margin = (share * own.width().max(own.height())).max(LEAST_MARGIN);
    let sides = [own.x_min() - margin, own.y_min() - margin, own.x_max() + margin, own.y_max() + margin];
    BoundingBox::try_from(sides).unwrap_or(*own)
}

fn jittered(own: &BoundingBox) -> BoundingBox {
    let (x, y) = (JITTER * own.width() + JITTER_PIXELS, JITTER * own.height() + JITTER_PIXELS);
    let sides = [own.x_min() - x, own.y_min() - y, own.x_max() + x, own.y_max() + y];
    BoundingBox::try_from(sides).unwrap_or(*own)
}

/// Mean of the static readings around a pixel that can be of its surface: their noise divided by three or more, and
/// unbiased on slopes, since places are averaged with depths.
fn smoothed(view: &ObjectView<'_>, [u, v]: [usize; 2], stride: usize) -> Point {
    let camera = view.frame.camera();
    let (width, height) = (camera.width(), camera.height());
    let radius = if stride > 3 { 2 } else { 1 };
    let depths = view.frame.depth().data();
    let z = depths[v * width + u];
    let reach = 3.0 * axial_noise(z) + 2.0 * radius as f32 * z / camera.fx().abs() as f32;
    let around =
        |at: usize, size: usize| -> Range<usize> { at.saturating_sub(radius)..(at + radius + 1).min(size) };
    let [mut sum_u, mut sum_v, mut sum_z, mut count] = [0.0_f32; 4];
    for row in around(v, height) {
        for column in around(u, width) {
            let other = depths[row * width + column];
            if (other - z).abs() <= reach && view.is_static(column, row) {
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

fn parabola(x: f32) -> f32 {
    (1.0 - x * x).max(0.0)
}
