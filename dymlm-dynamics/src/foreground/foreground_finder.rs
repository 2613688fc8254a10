use std::ops::Range;

use dymlm_core::{BoundingBox, DepthImage, Mask, PinholeCamera, Point};
use dymlm_geometry::{Clusters, Dbscan, DbscanConfig, DbscanScratch};

use super::{Foreground, ForegroundConfig};
use crate::Error;
use crate::image_scale::scaled_pixels;

/// A depth this far from the expected one halves a cluster's score, metres.
const EXPECTED_DEPTH_SCALE: f32 = 0.25;
/// Samples at which the window's sides cut a cluster, in square roots of its size, above which it is no part of a
/// mover.
const MAX_CUT: f32 = 0.5;
/// How far the surface between two samples may stick out of the range of depths sampled, metres.
const RANGE_MARGIN: f32 = 0.1;

/// Finds the mover among the pixels of its box: paper section III-A, "DBSCAN to extract foreground points".
///
/// The pixels of the box and of a margin around it are sampled on a grid, back-projected, and clustered by DBSCAN with a radius that grows with
/// depth, as the distance of neighbouring pixels and the sensor's noise do. To have one radius for all depths, the
/// points are taken in the coordinates (x / z, y / z, ln z), in which a distance of eps is one of eps z metres.
/// The cluster is chosen by its number of samples, each weighted by how central it lies in the box, how near to the
/// camera, how close to the depth at which the track was expected, and how little of the cluster goes on outside the
/// margin, as walls and tables do. Samples outside the box do not count for it.
///
/// Other clusters at the mover's depth that end within the margin are parts of the mover: what an occluder, another
/// limb or a gap without depth has parted, such as legs seen through the back of a chair, or a foot beside the box.
///
/// Costs O(n log n) for n samples, a few thousand for a person.
///
/// ```
/// use dymlm_core::{BoundingBox, DepthImage, PinholeCamera};
/// use dymlm_dynamics::{Foreground, ForegroundConfig, ForegroundFinder, ForegroundSearch};
///
/// // Somebody at 2 m, before a wall at 3 m.
/// let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5)?;
/// let person = |u: usize| (60..100).contains(&u);
/// let depth = (0..160 * 120).map(|i| if person(i % 160) { 2.0 } else { 3.0 }).collect();
/// let depth = DepthImage::new(160, 120, depth)?;
///
/// let mut finder = ForegroundFinder::new(ForegroundConfig::default())?;
/// let mut foreground = Foreground::new();
/// let search = ForegroundSearch::new(BoundingBox::new(50.0, 0.0, 110.0, 120.0)?);
/// finder.find(&camera, &depth, &search, &mut foreground);
/// assert_eq!(foreground.depth(), Some(2.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct ForegroundFinder {
    config: ForegroundConfig,
    dbscan: Dbscan,
    scratch: DbscanScratch,
    clusters: Clusters,
    samples: Vec<Sample>,
    points: Vec<Point>,
    scores: Vec<f32>,
    parts: Vec<Part>,
    depths: Vec<f32>,
}

/// Where to look for a foreground, and what is known of it.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct ForegroundSearch<'a> {
    /// The box, pixels.
    pub bounding_box: BoundingBox,
    /// The detector's instance mask: only its pixels are looked at.
    pub instance_mask: Option<&'a Mask>,
    /// The depth at which the mover should be, metres.
    pub expected_depth: Option<f32>,
}

impl ForegroundSearch<'_> {
    /// A search in a box, with nothing else known.
    pub fn new(bounding_box: BoundingBox) -> Self {
        Self { bounding_box, instance_mask: None, expected_depth: None }
    }
}

#[derive(Debug, Clone, Copy)]
struct Sample {
    cell: usize,
    depth: f32,
    /// 1 at the centre of the box, 0 at its sides and outside it.
    centrality: f32,
    is_in_box: bool,
    /// Whether the searched window ends beside it and its surface does not.
    is_cut: bool,
}

/// A cluster that may be a part of the mover.
#[derive(Debug, Clone, Copy, Default)]
struct Part {
    mean_depth: f32,
    size: usize,
    cut: usize,
}

impl Part {
    /// Samples at which the window cuts through it, in square roots of its size: about 2 to 4 for furniture and walls,
    /// which go on outside, and 0 for limbs.
    fn relative_cut(self) -> f32 {
        self.cut as f32 / (self.size.max(1) as f32).sqrt()
    }

    fn goes_on_outside(self) -> bool {
        self.relative_cut() > MAX_CUT
    }

    /// Factor of a score: 1 for what ends within the window.
    fn containment(self) -> f32 {
        1.0 / (1.0 + self.relative_cut().powi(2))
    }
}

/// The pixels of a box that lie in the image.
#[derive(Debug, Clone)]
struct Region {
    columns: Range<usize>,
    rows: Range<usize>,
}

impl Region {
    fn of(bounding_box: &BoundingBox, depth: &DepthImage) -> Self {
        let (columns, rows) = (bounding_box.columns(depth.width()), bounding_box.rows(depth.height()));
        if columns.is_empty() || rows.is_empty() {
            return Self { columns: 0..0, rows: 0..0 };
        }
        Self { columns, rows }
    }

    /// The region and `margin` pixels around it, within the image; that of nothing is nothing.
    fn widened(&self, margin: usize, depth: &DepthImage) -> Self {
        if self.columns.is_empty() {
            return self.clone();
        }
        let widen =
            |range: &Range<usize>, size| range.start.saturating_sub(margin)..(range.end + margin).min(size);
        Self { columns: widen(&self.columns, depth.width()), rows: widen(&self.rows, depth.height()) }
    }

    fn contains(&self, u: usize, v: usize) -> bool {
        self.columns.contains(&u) && self.rows.contains(&v)
    }
}

impl ForegroundFinder {
    /// Makes a finder.
    ///
    /// # Errors
    ///
    /// [`Error::Config`].
    pub fn new(config: ForegroundConfig) -> Result<Self, Error> {
        config.validate()?;
        let mut dbscan = DbscanConfig::default();
        dbscan.eps = config.eps;
        dbscan.min_points = config.min_points;
        Ok(Self {
            config,
            dbscan: Dbscan::new(dbscan)?,
            scratch: DbscanScratch::default(),
            clusters: Clusters::default(),
            samples: Vec::new(),
            points: Vec::new(),
            scores: Vec::new(),
            parts: Vec::new(),
            depths: Vec::new(),
        })
    }

    /// Finds the foreground of a box. It is empty when the box is, or when nothing in it has a depth.
    pub fn find(
        &mut self,
        camera: &PinholeCamera,
        depth: &DepthImage,
        search: &ForegroundSearch<'_>,
        foreground: &mut Foreground,
    ) {
        self.lay_grid(depth, search, foreground);
        self.sample(camera, depth, search, foreground);
        self.dbscan.cluster_into(&self.points, &mut self.scratch, &mut self.clusters);
        self.describe_clusters();
        if let Some(chosen) = self.choose(search.expected_depth) {
            self.keep(chosen, foreground);
        }
    }

    fn lay_grid(&self, depth: &DepthImage, search: &ForegroundSearch<'_>, foreground: &mut Foreground) {
        let stride = scaled_pixels(self.config.stride as f32, depth.width()).max(1);
        let in_box = Region::of(&search.bounding_box, depth);
        let window = in_box.widened(scaled_pixels(self.config.margin, depth.width()), depth);
        foreground.stride = stride;
        foreground.first_column = window.columns.start / stride;
        foreground.first_row = window.rows.start / stride;
        foreground.columns = cells(&window.columns, stride);
        foreground.rows = cells(&window.rows, stride);
        foreground.box_cells = cells(&in_box.columns, stride) * cells(&in_box.rows, stride);
        foreground.depths.clear();
        foreground.depths.resize(foreground.columns * foreground.rows, 0.0);
        (foreground.count, foreground.box_count) = (0, 0);
        foreground.max_step = self.config.max_step;
    }

    /// Takes the middle pixel of each cell.
    fn sample(
        &mut self,
        camera: &PinholeCamera,
        depth: &DepthImage,
        search: &ForegroundSearch<'_>,
        foreground: &Foreground,
    ) {
        self.samples.clear();
        self.points.clear();
        let region = &search.bounding_box;
        let in_box = Region::of(region, depth);
        let window = in_box.widened(scaled_pixels(self.config.margin, depth.width()), depth);
        let stride = foreground.stride;
        let [center_u, center_v] = region.center();
        let (half_width, half_height) = (0.5 * region.width(), 0.5 * region.height());
        for row in 0..foreground.rows {
            let v = (foreground.first_row + row) * foreground.stride + foreground.stride / 2;
            if !window.rows.contains(&v) {
                continue;
            }
            let depths = depth.row(v);
            let vertical = parabola((v as f32 - center_v) / half_height);
            let ray_y = ((v as f64 - camera.cy()) / camera.fy()) as f32;
            for column in 0..foreground.columns {
                let u = (foreground.first_column + column) * foreground.stride + foreground.stride / 2;
                let z = depths.get(u).copied().unwrap_or(0.0);
                let outside = search.instance_mask.is_some_and(|mask| !mask.at(u, v));
                if z == 0.0 || outside || !window.columns.contains(&u) {
                    continue;
                }
                let ray_x = ((u as f64 - camera.cx()) / camera.fx()) as f32;
                self.points.push([ray_x, ray_y, z.ln()]);
                self.samples.push(Sample {
                    cell: row * foreground.columns + column,
                    depth: z,
                    is_cut: neighbours(u, v, stride).any(|(u, v)| {
                        let outside = depth.at(u, v);
                        !window.contains(u, v) && (outside - z).abs() <= self.config.eps * z
                    }),
                    is_in_box: in_box.contains(u, v),
                    centrality: vertical * parabola((u as f32 - center_u) / half_width),
                });
            }
        }
    }

    /// Mean depth of each cluster, and how much of it the window's sides cut.
    fn describe_clusters(&mut self) {
        self.parts.clear();
        self.parts.resize(self.clusters.count(), Part::default());
        for (sample, label) in self.samples.iter().zip(self.clusters.labels()) {
            if let Some(part) = label.and_then(|label| self.parts.get_mut(label as usize)) {
                part.mean_depth += sample.depth;
                part.cut += usize::from(sample.is_cut);
            }
        }
        for (part, &size) in self.parts.iter_mut().zip(self.clusters.sizes()) {
            part.mean_depth /= size as f32;
            part.size = size;
        }
    }

    /// The cluster of the highest score.
    fn choose(&mut self, expected_depth: Option<f32>) -> Option<u32> {
        let in_box = self.samples.iter().filter(|sample| sample.is_in_box);
        let nearest = percentile(&mut self.depths, in_box.map(|sample| sample.depth), 0.05)?;
        self.scores.clear();
        self.scores.resize(self.clusters.count(), 0.0);
        for (sample, label) in self.samples.iter().zip(self.clusters.labels()) {
            let Some(score) = label.and_then(|label| self.scores.get_mut(label as usize)) else { continue };
            let expectation = match expected_depth {
                Some(expected) => {
                    let off = (sample.depth - expected) / EXPECTED_DEPTH_SCALE;
                    1.0 / (1.0 + off * off)
                }
                None => (nearest / sample.depth).min(1.0).powi(2),
            };
            *score += sample.centrality * expectation;
        }
        for (score, part) in self.scores.iter_mut().zip(&self.parts) {
            *score *= part.containment();
        }
        let best = self.scores.iter().copied().enumerate().reduce(|a, b| if b.1 > a.1 { b } else { a });
        best.map(|(label, _)| label as u32)
    }

    /// Writes the samples of the mover into the grid: those of the chosen cluster, and of all others that lie at its
    /// depth and end within the window. Of a chosen cluster that goes on outside only what lies in the box is kept.
    fn keep(&mut self, chosen: u32, foreground: &mut Foreground) {
        let labelled = || self.samples.iter().zip(self.clusters.labels());
        let members = labelled().filter(|(sample, label)| sample.is_in_box && **label == Some(chosen));
        let members = members.map(|(sample, _)| sample.depth);
        let Some(median) = percentile(&mut self.depths, members, 0.5) else { return };
        let reach = |distance: f32| median - distance..=median + distance;
        let sample_reach = reach(self.config.max_reach);
        let part_reach = median - self.config.part_reach_near..=median + self.config.part_reach_far;

        foreground.median = median;
        (foreground.near, foreground.far) = (median, median);
        for (sample, label) in labelled() {
            let is_part = label.is_some_and(|label| {
                let part = self.parts.get(label as usize).copied().unwrap_or_default();
                let is_at_its_depth = label == chosen || part_reach.contains(&part.mean_depth);
                (label == chosen && sample.is_in_box) || (is_at_its_depth && !part.goes_on_outside())
            });
            if is_part && sample_reach.contains(&sample.depth) {
                foreground.depths[sample.cell] = sample.depth;
                foreground.count += 1;
                foreground.box_count += usize::from(sample.is_in_box);
                foreground.near = foreground.near.min(sample.depth);
                foreground.far = foreground.far.max(sample.depth);
            }
        }
        foreground.near = (foreground.near - RANGE_MARGIN).max(f32::MIN_POSITIVE);
        foreground.far += RANGE_MARGIN;
    }
}

/// The pixels a stride to the left, right, above and below.
fn neighbours(u: usize, v: usize, stride: usize) -> impl Iterator<Item = (usize, usize)> {
    [
        (u.checked_sub(stride), Some(v)),
        (Some(u + stride), Some(v)),
        (Some(u), v.checked_sub(stride)),
        (Some(u), Some(v + stride)),
    ]
    .into_iter()
    .filter_map(|(u, v)| u.zip(v))
}

/// The number of cells that a range of pixels touches.
fn cells(range: &Range<usize>, stride: usize) -> usize {
    if range.is_empty() { 0 } else { range.end.div_ceil(stride) - range.start / stride }
}

fn parabola(x: f32) -> f32 {
    (1.0 - x * x).max(0.0)
}

/// The value below which a `share` of the values lies; `None` of none.
fn percentile(buffer: &mut Vec<f32>, values: impl Iterator<Item = f32>, share: f32) -> Option<f32> {
    buffer.clear();
    buffer.extend(values);
    let rank = (share * buffer.len() as f32) as usize;
    (rank < buffer.len()).then(|| *buffer.select_nth_unstable_by(rank, f32::total_cmp).1)
}
