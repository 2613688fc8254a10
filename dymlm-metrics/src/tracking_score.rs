use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::{BoundingBox, ConfigError, check_range};

use crate::assignment::{ONE, assign};

/// A box of a person or thing, whose id is the same in all frames.
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub struct IdentifiedBox {
    /// Id of the person or thing.
    pub id: u64,
    /// The box in the image, pixels.
    pub bounding_box: BoundingBox,
}

/// Least intersection over union of an output box with the true box that it is paired with: that of the MOT
/// Challenge.
const MIN_IOU: f64 = 0.5;
/// Intersection over union with all detections below which a true box is missed by the detector: the gate of
/// SORT's association.
const MISSED_IOU: f64 = 0.3;

/// Why a frame was refused. A refused frame changes nothing.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum TrackingScoreError {
    /// Two boxes of one frame have the same id.
    #[error("{what} of one frame have the id {id} twice")]
    DuplicateId {
        /// Which list the boxes are in.
        what: &'static str,
        /// The id that they share.
        id: u64,
    },
}

/// Scores the boxes that a tracker outputs, frame by frame, against the true boxes.
///
/// - **MOTA** = 1 - (misses + false boxes + switches) / true boxes, after Bernardin, Stiefelhagen:
///   "Evaluating Multiple Object Tracking Performance: The CLEAR MOT Metrics", 2008. In each frame a true box
///   first keeps the id that it was last paired with, if that box still overlaps it by `min_iou` (0.5). The
///   others are paired to have as many pairs as possible and, among these choices, the greatest overlaps. A
///   pair with another id than the last one is a switch, however long ago the last pair was.
/// - **IDF1** = 2 IDTP / (true boxes + output boxes), after Ristani, Solera, Zou, Cucchiara, Tomasi:
///   "Performance Measures and a Data Set for Multi-Target, Multi-Camera Tracking", 2016. Over the whole
///   sequence, each true id is assigned at most one output id and vice versa. IDTP is the greatest number of
///   frames, summed over the assigned ids, in which their boxes overlap by `min_iou`.
/// - **Misses recovered** = share of the true boxes that an output box overlaps by `min_iou`, among those
///   that no raw detection overlaps by 0.3.
///
/// The figures equal those of the Python package `motmetrics`. A frame of n true and m output boxes costs O(n
/// m), and O(n m^2) among boxes that compete; IDF1 costs O(n m^2) in the numbers of ids.
///
/// ```
/// use dymlm_core::BoundingBox;
/// use dymlm_metrics::{IdentifiedBox, TrackingScorer};
///
/// let [left, right] = [BoundingBox::new(0.0, 0.0, 10.0, 20.0)?, BoundingBox::new(1.0, 0.0, 11.0, 20.0)?];
/// let truth = [IdentifiedBox { id: 1, bounding_box: left }];
/// let output = [IdentifiedBox { id: 7, bounding_box: right }];
/// let mut scorer = TrackingScorer::new();
/// scorer.add_frame(&truth, &output, Some(&[]))?; // The detector missed it.
/// scorer.add_frame(&truth, &[], None)?;
/// let score = scorer.score();
/// assert_eq!((score.mota, score.misses_recovered), (Some(0.5), Some(1.0)));
/// assert_eq!(score.idf1, Some(2.0 / 3.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct TrackingScorer {
    min_iou: f64,
    counts: Counts,
    /// The output id that each true id was last paired with.
    partners: BTreeMap<u64, u64>,
    /// Number of frames in which the boxes of a true id and an output id overlap.
    together: BTreeMap<[u64; 2], u64>,
}

/// The result of [`TrackingScorer::score`].
#[derive(Debug, Clone, Copy, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[non_exhaustive]
pub struct TrackingScore {
    /// 1 - (misses + false boxes + switches) / true boxes: at most 1, and below 0 with many errors; `None`
    /// without true boxes.
    pub mota: Option<f64>,
    /// 2 IDTP / (true boxes + output boxes), 0..=1; `None` without any boxes.
    pub idf1: Option<f64>,
    /// Share of the detector's misses that output boxes cover, 0..=1; `None` when there are no misses.
    pub misses_recovered: Option<f64>,
    /// Mean intersection over union of the pairs, 0..=1; `None` without pairs.
    pub mean_iou: Option<f64>,
    /// Number of true boxes.
    pub true_boxes: u64,
    /// Number of output boxes.
    pub output_boxes: u64,
    /// True boxes without a partner.
    pub misses: u64,
    /// Output boxes without a partner.
    pub false_boxes: u64,
    /// Pairs whose true box was last paired with another id.
    pub switches: u64,
    /// True boxes that no detection shows, in frames whose detections were given.
    pub missed_detections: u64,
    /// True boxes that no detection shows but an output box covers.
    pub recovered_detections: u64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Counts {
    true_boxes: u64,
    output_boxes: u64,
    pairs: u64,
    switches: u64,
    missed_detections: u64,
    recovered_detections: u64,
    iou: f64,
}

impl Default for TrackingScorer {
    fn default() -> Self {
        Self::new()
    }
}

impl TrackingScorer {
    /// A scorer without frames that pairs boxes with an intersection over union of at least 0.5, as in the
    /// MOT Challenge.
    pub fn new() -> Self {
        Self::of_overlap(MIN_IOU)
    }

    /// A scorer without frames that pairs boxes with an intersection over union of at least `min_iou`,
    /// 0.01..=1.
    ///
    /// # Errors
    ///
    /// [`ConfigError`] when it is outside its range.
    pub fn with_min_iou(min_iou: f64) -> Result<Self, ConfigError> {
        check_range("min_iou", min_iou, 0.01..=1.0)?;
        Ok(Self::of_overlap(min_iou))
    }

    fn of_overlap(min_iou: f64) -> Self {
        Self { min_iou, counts: Counts::default(), partners: BTreeMap::new(), together: BTreeMap::new() }
    }

    /// Adds a frame, in the order of time: the true boxes of the movers in view, the boxes that the tracker
    /// outputs, and the raw detections if recovered misses are to be counted. The order within each list does
    /// not matter.
    ///
    /// # Errors
    ///
    /// [`TrackingScoreError::DuplicateId`]; nothing is added.
    pub fn add_frame(
        &mut self,
        truth: &[IdentifiedBox],
        output: &[IdentifiedBox],
        detections: Option<&[BoundingBox]>,
    ) -> Result<(), TrackingScoreError> {
        self.add_frame_ignoring(&[], truth, output, detections)
    }

    /// Adds a frame with things that may be found or not, such as slivers of people at the image's border:
    /// `ignored` are their true boxes. As in the MOT Challenge (Milan et al.: "MOT16", 2016), the output
    /// boxes are first assigned to true and ignored boxes together, and those assigned to ignored boxes are
    /// left out.
    ///
    /// # Errors
    ///
    /// [`TrackingScoreError::DuplicateId`]; nothing is added.
    pub fn add_frame_ignoring(
        &mut self,
        ignored: &[BoundingBox],
        truth: &[IdentifiedBox],
        output: &[IdentifiedBox],
        detections: Option<&[BoundingBox]>,
    ) -> Result<(), TrackingScoreError> {
        let (truth, mut output) = (by_id("true boxes", truth)?, by_id("output boxes", output)?);
        self.leave_out_ignored(ignored, &truth, &mut output);
        let overlaps = Overlaps::new(&boxes(&truth), &boxes(&output), self.min_iou);
        self.counts.true_boxes += truth.len() as u64;
        self.counts.output_boxes += output.len() as u64;
        self.count_together(&truth, &output, &overlaps);
        self.pair(&truth, &output, &overlaps);
        if let Some(detections) = detections {
            self.count_recovered(&truth, &overlaps, detections);
        }
        Ok(())
    }

    /// The score of the frames so far.
    pub fn score(&self) -> TrackingScore {
        let counts = &self.counts;
        let misses = counts.true_boxes - counts.pairs;
        let false_boxes = counts.output_boxes - counts.pairs;
        let errors = misses + false_boxes + counts.switches;
        let boxes = counts.true_boxes + counts.output_boxes;
        TrackingScore {
            mota: ratio(errors as f64, counts.true_boxes).map(|errors| 1.0 - errors),
            idf1: ratio(2.0 * self.identity_true_positives() as f64, boxes),
            misses_recovered: ratio(counts.recovered_detections as f64, counts.missed_detections),
            mean_iou: ratio(counts.iou, counts.pairs),
            true_boxes: counts.true_boxes,
            output_boxes: counts.output_boxes,
            misses,
            false_boxes,
            switches: counts.switches,
            missed_detections: counts.missed_detections,
            recovered_detections: counts.recovered_detections,
        }
    }

    fn leave_out_ignored(
        &self,
        ignored: &[BoundingBox],
        truth: &[IdentifiedBox],
        output: &mut Vec<IdentifiedBox>,
    ) {
        if ignored.is_empty() {
            return;
        }
        let mut all = boxes(truth);
        all.extend(ignored);
        let overlaps = Overlaps::new(&all, &boxes(output), self.min_iou);
        let mut kept = vec![true; output.len()];
        for (row, column) in overlaps.assign(|_, _| true) {
            kept[column] = row < truth.len();
        }
        let mut kept = kept.into_iter();
        output.retain(|_| kept.next().unwrap_or(true));
    }

    fn count_together(&mut self, truth: &[IdentifiedBox], output: &[IdentifiedBox], overlaps: &Overlaps) {
        for (row, t) in truth.iter().enumerate() {
            for (column, _) in overlaps.row(row).iter().enumerate().filter(|(_, iou)| iou.is_some()) {
                *self.together.entry([t.id, output[column].id]).or_default() += 1;
            }
        }
    }

    /// Pairs true and output boxes: first the pairs of earlier frames, then the others.
    fn pair(&mut self, truth: &[IdentifiedBox], output: &[IdentifiedBox], overlaps: &Overlaps) {
        let mut pairs = vec![None; truth.len()];
        let mut taken = vec![false; output.len()];
        for (row, t) in truth.iter().enumerate() {
            let Some(partner) = self.partners.get(&t.id) else { continue };
            let Ok(column) = output.binary_search_by_key(partner, |o| o.id) else { continue };
            if !taken[column] && overlaps.at(row, column).is_some() {
                pairs[row] = Some(column);
                taken[column] = true;
            }
        }
        let anew = overlaps.assign(|row, column| pairs[row].is_none() && !taken[column]);
        for (row, column) in anew {
            pairs[row] = Some(column);
        }

        for (row, column) in pairs.into_iter().enumerate().filter_map(|(row, column)| Some((row, column?))) {
            self.counts.pairs += 1;
            self.counts.iou += overlaps.at(row, column).unwrap_or(0.0);
            let before = self.partners.insert(truth[row].id, output[column].id);
            self.counts.switches += u64::from(before.is_some_and(|before| before != output[column].id));
        }
    }

    fn count_recovered(&mut self, truth: &[IdentifiedBox], overlaps: &Overlaps, detections: &[BoundingBox]) {
        for (row, t) in truth.iter().enumerate() {
            let shows = |d: &BoundingBox| d.iou(&t.bounding_box) >= MISSED_IOU;
            if !detections.iter().any(shows) {
                self.counts.missed_detections += 1;
                self.counts.recovered_detections += u64::from(overlaps.row(row).iter().any(Option::is_some));
            }
        }
    }

    /// The number of frames in which ids overlap, summed over the best one-to-one assignment of ids.
    fn identity_true_positives(&self) -> u64 {
        let ids = |side: usize| {
            let unique: BTreeSet<u64> = self.together.keys().map(|pair| pair[side]).collect();
            unique.into_iter().collect::<Vec<u64>>()
        };
        let [truth, output] = [ids(0), ids(1)];
        let frames = |row: usize, column: usize| {
            self.together.get(&[truth[row], output[column]]).copied().unwrap_or(0) as i64
        };
        let pairs = assign(truth.len(), output.len(), frames);
        pairs.into_iter().map(|(row, column)| frames(row, column) as u64).sum()
    }
}

/// Intersections over union of true boxes (rows) and output boxes (columns), if they reach the threshold.
struct Overlaps {
    rows: usize,
    columns: usize,
    iou: Vec<Option<f64>>,
}

impl Overlaps {
    fn new(truth: &[BoundingBox], output: &[BoundingBox], min_iou: f64) -> Self {
        let pairs = truth.iter().flat_map(|t| output.iter().map(move |o| t.iou(o)));
        let iou = pairs.map(|iou| (iou >= min_iou).then_some(iou)).collect();
        Self { rows: truth.len(), columns: output.len(), iou }
    }

    /// The largest set of allowed pairs that overlap enough; among such sets, the one with the greatest
    /// overlaps.
    fn assign(&self, may: impl Fn(usize, usize) -> bool) -> Vec<(usize, usize)> {
        assign(self.rows, self.columns, |row, column| {
            let iou = self.at(row, column).filter(|_| may(row, column));
            // One more pair outweighs all overlaps together.
            iou.map_or(0, |iou| (self.rows as i64 + 2) * ONE + (iou * ONE as f64) as i64)
        })
    }

    fn row(&self, row: usize) -> &[Option<f64>] {
        &self.iou[row * self.columns..(row + 1) * self.columns]
    }

    fn at(&self, row: usize, column: usize) -> Option<f64> {
        self.iou[row * self.columns + column]
    }
}

fn boxes(of: &[IdentifiedBox]) -> Vec<BoundingBox> {
    of.iter().map(|b| b.bounding_box).collect()
}

/// The boxes by ascending id, so that the caller's order has no effect.
fn by_id(what: &'static str, boxes: &[IdentifiedBox]) -> Result<Vec<IdentifiedBox>, TrackingScoreError> {
    let mut boxes = boxes.to_vec();
    boxes.sort_unstable_by_key(|b| b.id);
    match boxes.windows(2).find(|pair| pair[0].id == pair[1].id) {
        Some(pair) => Err(TrackingScoreError::DuplicateId { what, id: pair[0].id }),
        None => Ok(boxes),
    }
}

fn ratio(part: f64, whole: u64) -> Option<f64> {
    (whole > 0).then(|| part / whole as f64)
}
