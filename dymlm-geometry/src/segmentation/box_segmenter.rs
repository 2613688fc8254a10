use dymlm_core::{ConfigError, Point};

use super::depth_scale::DepthScale;
use super::{BoxCluster, BoxView, GridSample, SampleGrid, SegmentationConfig};
use crate::{Clusters, Dbscan, DbscanConfig, DbscanScratch};

/// Finds the clusters of a box's samples, and the one that is the thing in the box.
///
/// DBSCAN runs in the coordinates (column, row, depth), each in units of its own radius: columns and rows by
/// the distance of the samples, depths by the sensor's noise and by how much a sloping surface recedes from
/// one sample to the next, both at their depth. So the same settings hold for every camera and depth.
///
/// Costs O(n log n) for n samples.
///
/// ```
/// use dymlm_core::{BoundingBox, DepthImage, Frame, PinholeCamera, SensorModel};
/// use dymlm_geometry::{BoxSegmenter, BoxView, SampleGrid, SegmentationConfig};
///
/// // Somebody at 2 m, before a wall at 3 m.
/// let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5)?;
/// let person = |u: usize| (60..100).contains(&u);
/// let depth = (0..160 * 120).map(|i| if person(i % 160) { 2.0 } else { 3.0 }).collect();
/// let frame = Frame::new(0.0, camera, DepthImage::new(160, 120, depth)?, None)?;
/// let bounding_box = BoundingBox::new(50.0, 0.0, 110.0, 120.0)?;
///
/// let mut segmenter = BoxSegmenter::new(SegmentationConfig::default())?;
/// let mut grid = SampleGrid::default();
/// segmenter.sample(&BoxView::new(&frame, &SensorModel::kinect(), bounding_box), &mut grid);
/// segmenter.cluster(&grid, |_| true);
/// let person = segmenter.best(&grid, |sample| sample.centrality, |_| 1.0).unwrap();
/// assert_eq!(segmenter.clusters()[person].depth, 2.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct BoxSegmenter {
    config: SegmentationConfig,
    dbscan: Dbscan,
    scale: DepthScale,
    scratch: DbscanScratch,
    found: Clusters,
    points: Vec<Point>,
    /// The sample of each point.
    sample_of: Vec<u32>,
    clusters: Vec<BoxCluster>,
    scores: Vec<f32>,
}

/// Radius of DBSCAN in the image, in distances between samples: two along an axis, and the diagonals within
/// that are reached, such as (2, 1).
const EPS_SAMPLES: f32 = 2.5;
/// Neighbours that make a core sample, itself counted: those that a strip one sample wide has within the
/// radius, such as a leg seen through the slats of a chair.
const MIN_POINTS: usize = 5;

impl BoxSegmenter {
    /// Checks the config.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] names the field outside its range.
    pub fn new(config: SegmentationConfig) -> Result<Self, ConfigError> {
        config.validate()?;
        let dbscan = DbscanConfig { eps: 1.0, min_points: MIN_POINTS };
        Ok(Self {
            config,
            dbscan: Dbscan::new(dbscan)?,
            scale: DepthScale::default(),
            scratch: DbscanScratch::default(),
            found: Clusters::default(),
            points: Vec::new(),
            sample_of: Vec::new(),
            clusters: Vec::new(),
            scores: Vec::new(),
        })
    }

    /// Lays a grid over a box and a margin around it and samples it. A box outside the image has no cells.
    ///
    /// O(pixels / stride^2), nine times as much when samples are smoothed.
    pub fn sample(&self, view: &BoxView<'_>, grid: &mut SampleGrid) {
        grid.fill(view, &self.config);
    }

    /// Clusters those samples of a grid whose index `takes_part`.
    pub fn cluster(&mut self, grid: &SampleGrid, takes_part: impl Fn(usize) -> bool) {
        self.points.clear();
        self.sample_of.clear();
        if let Some(radius) = &grid.radius {
            self.scale.set(radius);
        }
        for (index, sample) in grid.samples.iter().enumerate().filter(|(index, _)| takes_part(*index)) {
            let [column, row] = [sample.column, sample.row].map(|cell| cell as f32 / EPS_SAMPLES);
            self.points.push([column, row, self.scale.at(sample.point[2])]);
            self.sample_of.push(index as u32);
        }
        self.dbscan.cluster_into(&self.points, &mut self.scratch, &mut self.found);
        self.clusters.clear();
        self.clusters.resize(self.found.count(), BoxCluster::NONE);
        for (&index, label) in self.sample_of.iter().zip(self.found.labels()) {
            if let (Some(label), Some(sample)) = (label, grid.samples.get(index as usize))
                && let Some(cluster) = self.clusters.get_mut(*label as usize)
            {
                cluster.add(sample);
            }
        }
        self.clusters.iter_mut().for_each(BoxCluster::finish);
    }

    /// The clusters, in the order of their first core samples.
    pub fn clusters(&self) -> &[BoxCluster] {
        &self.clusters
    }

    /// Index of each clustered sample and of its cluster, by ascending sample.
    pub fn members(&self) -> impl Iterator<Item = (usize, usize)> {
        let labelled = self.sample_of.iter().zip(self.found.labels());
        labelled.filter_map(|(&sample, label)| label.map(|label| (sample as usize, label as usize)))
    }

    /// The cluster with the highest score: the sum of `weight` over its samples in the box, times the
    /// cluster's `factor`. The first one among equals; `None` when no score is positive.
    pub fn best(
        &mut self,
        grid: &SampleGrid,
        weight: impl Fn(&GridSample) -> f32,
        factor: impl Fn(&BoxCluster) -> f32,
    ) -> Option<usize> {
        let mut scores = std::mem::take(&mut self.scores);
        scores.clear();
        scores.resize(self.clusters.len(), 0.0);
        for (sample, cluster) in self.members() {
            if let Some(sample) = grid.samples.get(sample).filter(|sample| sample.is_in_box) {
                scores[cluster] += weight(sample);
            }
        }
        for (score, cluster) in scores.iter_mut().zip(&self.clusters) {
            *score *= factor(cluster);
        }
        let best =
            scores.iter().copied().enumerate().reduce(|best, next| if next.1 > best.1 { next } else { best });
        self.scores = scores;
        best.filter(|(_, score)| *score > 0.0).map(|(cluster, _)| cluster)
    }
}
