use std::fmt;

use dymlm::core::Detection;

/// Least intersection over union at which two boxes count as the same thing.
const SAME_THING: f64 = 0.5;
/// Score from which a detection counts as a sure one.
const SURE: f32 = 0.5;

/// How much detections differ from another detector's in the same images.
///
/// ```
/// use dymlm::core::{BoundingBox, Detection};
///
/// let cup = Detection::new("cup", 0.7, BoundingBox::new(0.0, 0.0, 20.0, 10.0)?)?;
/// let moved = Detection::new("cup", 0.6, BoundingBox::new(0.0, 0.0, 16.0, 10.0)?)?;
/// let mut comparison = dymlm_detect::Comparison::default();
/// comparison.add(&[moved], &[cup]);
/// assert_eq!((comparison.matched(), comparison.mean_iou()), (1, 0.8));
/// # Ok::<(), dymlm::core::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Comparison {
    frames: usize,
    found: Counts,
    reference: Counts,
    matched: usize,
    sum_of_ious: f64,
    lowest_iou: f64,
    largest_score_difference: f32,
}

/// Detections of all scores, and of 0.5 or more.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct Counts {
    all: usize,
    sure: usize,
}

impl Comparison {
    /// Adds the detections in an image and the reference detections in it. Boxes of the same label are
    /// matched one to one, those with the largest overlap first, down to an overlap of half.
    pub fn add(&mut self, found: &[Detection], reference: &[Detection]) {
        self.frames += 1;
        self.found.add(found);
        self.reference.add(reference);
        for (iou, [one, other]) in matches(found, reference) {
            self.lowest_iou = if self.matched == 0 { iou } else { self.lowest_iou.min(iou) };
            self.matched += 1;
            self.sum_of_ious += iou;
            let difference = (one.score() - other.score()).abs();
            self.largest_score_difference = self.largest_score_difference.max(difference);
        }
    }

    /// Number of images.
    pub fn frames(&self) -> usize {
        self.frames
    }

    /// Number of detections found, and number of the reference.
    pub fn counts(&self) -> [usize; 2] {
        [self.found.all, self.reference.all]
    }

    /// The same for detections with a score of 0.5 or more.
    pub fn sure_counts(&self) -> [usize; 2] {
        [self.found.sure, self.reference.sure]
    }

    /// Number of matched pairs.
    pub fn matched(&self) -> usize {
        self.matched
    }

    /// Mean intersection over union of the matched pairs; 1 without any.
    pub fn mean_iou(&self) -> f64 {
        if self.matched == 0 { 1.0 } else { self.sum_of_ious / self.matched as f64 }
    }

    /// Lowest intersection over union of a matched pair; 1 without any.
    pub fn lowest_iou(&self) -> f64 {
        if self.matched == 0 { 1.0 } else { self.lowest_iou }
    }

    /// Largest difference of the scores of two matched detections.
    pub fn largest_score_difference(&self) -> f32 {
        self.largest_score_difference
    }
}

impl fmt::Display for Comparison {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([all, other_all], [sure, other_sure]) = (self.counts(), self.sure_counts());
        write!(
            out,
            "{} frames: {all} detections for {other_all}, {sure} for {other_sure} of score 0.5 or more; {} matched, IoU \
             {:.5} in the mean and {:.5} at least, scores differ by {:.5} at most",
            self.frames,
            self.matched,
            self.mean_iou(),
            self.lowest_iou(),
            self.largest_score_difference
        )
    }
}

impl Counts {
    fn add(&mut self, detections: &[Detection]) {
        self.all += detections.len();
        self.sure += detections.iter().filter(|detection| detection.score() >= SURE).count();
    }
}

/// Pairs of one label with their overlap, the largest first; each detection is in one at most.
fn matches<'a>(found: &'a [Detection], reference: &'a [Detection]) -> Vec<(f64, [&'a Detection; 2])> {
    let mut pairs = Vec::new();
    for (i, one) in found.iter().enumerate() {
        for (j, other) in reference.iter().enumerate().filter(|(_, other)| other.label() == one.label()) {
            pairs.push((one.bounding_box().iou(&other.bounding_box()), i, j));
        }
    }
    pairs.retain(|&(iou, ..)| iou >= SAME_THING);
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    let (mut taken, mut taken_reference) = (vec![false; found.len()], vec![false; reference.len()]);
    pairs.retain(|&(_, i, j)| {
        let is_free = !taken[i] && !taken_reference[j];
        if is_free {
            (taken[i], taken_reference[j]) = (true, true);
        }
        is_free
    });
    pairs.into_iter().map(|(iou, i, j)| (iou, [&found[i], &reference[j]])).collect()
}

#[cfg(test)]
mod tests {
    use dymlm::core::BoundingBox;

    use super::*;

    fn detection(label: &str, score: f32, left: f32) -> Detection {
        Detection::new(label, score, BoundingBox::new(left, 0.0, left + 10.0, 10.0).unwrap()).unwrap()
    }

    #[test]
    fn the_same_detections_differ_by_nothing() {
        let both = [detection("cup", 0.9, 0.0), detection("cup", 0.4, 1.0), detection("bowl", 0.5, 0.0)];
        let mut comparison = Comparison::default();
        comparison.add(&both, &both);
        assert_eq!((comparison.matched(), comparison.mean_iou(), comparison.lowest_iou()), (3, 1.0, 1.0));
        assert_eq!((comparison.counts(), comparison.sure_counts()), ([3, 3], [2, 2]));
        assert_eq!(comparison.largest_score_difference(), 0.0);
    }

    #[test]
    fn each_is_matched_once_and_by_its_own_label() {
        let mut comparison = Comparison::default();
        // The second box overlaps the reference more; the bowl and the far cup have no match.
        let found = [detection("cup", 0.5, 2.0), detection("cup", 0.7, 1.0), detection("bowl", 0.9, 0.0)];
        comparison.add(&found, &[detection("cup", 0.75, 0.0), detection("cup", 0.5, 40.0)]);
        assert_eq!((comparison.frames(), comparison.matched()), (1, 1));
        assert_eq!(comparison.mean_iou(), 9.0 / 11.0);
        assert!((comparison.largest_score_difference() - 0.05).abs() < 1e-6);
        comparison.add(&[detection("cup", 0.5, 0.0)], &[detection("cup", 0.5, 0.0)]);
        assert_eq!((comparison.matched(), comparison.lowest_iou()), (2, 9.0 / 11.0));
        assert!((comparison.mean_iou() - 10.0 / 11.0).abs() < 1e-12);
    }

    #[test]
    fn nothing_differs_from_nothing() {
        let mut comparison = Comparison::default();
        comparison.add(&[], &[]);
        assert_eq!((comparison.mean_iou(), comparison.lowest_iou(), comparison.counts()), (1.0, 1.0, [0, 0]));
    }
}
