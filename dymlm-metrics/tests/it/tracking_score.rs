//! Scores of tracked boxes, made wrong on purpose and beside another tool's figures.
use dymlm_core::BoundingBox;
use dymlm_metrics::{IdentifiedBox, TrackingScore, TrackingScoreError, TrackingScorer};
use proptest::prelude::*;

type Boxes = Vec<IdentifiedBox>;

/// A frame: true boxes, output boxes, detections.
type Frame = (Boxes, Boxes, Vec<BoundingBox>);

fn rectangle(x: i64, y: i64, width: i64, height: i64) -> BoundingBox {
    let [x, y, width, height] = [x, y, width, height].map(|value| value as f32);
    BoundingBox::new(x, y, x + width, y + height).unwrap()
}

fn score(frames: &[Frame], min_iou: f64) -> TrackingScore {
    let mut scorer = TrackingScorer::with_min_iou(min_iou).unwrap();
    for (truth, output, detections) in frames {
        scorer.add_frame(truth, output, Some(detections)).unwrap();
    }
    scorer.score()
}

/// Two people walk for ten frames, far apart. The output is the truth under other ids, and the detector sees
/// all.
fn two_people() -> Vec<Frame> {
    let frame = |f: i64| {
        let at = |id: u64, x: i64| IdentifiedBox { id, bounding_box: rectangle(x + 3 * f, 50, 40, 120) };
        let truth = vec![at(0, 10), at(1, 300)];
        let output = truth.iter().map(|b| IdentifiedBox { id: b.id + 70, ..*b }).collect();
        let detections = truth.iter().map(|b| b.bounding_box).collect();
        (truth, output, detections)
    };
    (0..10).map(frame).collect()
}

fn assert_near(actual: Option<f64>, expected: f64) {
    assert!(actual.is_some_and(|actual| (actual - expected).abs() < 1e-12), "{actual:?}, not {expected}");
}

/// The linear congruential generator, which the Python program for motmetrics also used.
struct Lcg(u64);

impl Lcg {
    fn below(&mut self, n: u64) -> i64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 33) % n) as i64
    }
}

/// Five objects for 80 frames: sometimes not in view; output boxes missing, shifted and resized, under ids
/// that change with time and that two objects exchange at frame 30; false boxes; a detector that misses four
/// of ten.
fn random_case() -> Vec<Frame> {
    let mut lcg = Lcg(12345);
    let frame = |f: i64| {
        let (mut truth, mut output, mut detections) = (Vec::new(), Vec::new(), Vec::new());
        for i in 0..5 {
            if lcg.below(10) == 0 {
                continue;
            }
            let (x, y) = (30 + 35 * i + f * (i + 1) * 2 % 60, 20 + 10 * i);
            truth.push(IdentifiedBox { id: i as u64, bounding_box: rectangle(x, y, 30, 60) });
            if lcg.below(10) < 8 {
                let (dx, dy) = (lcg.below(17) - 8, lcg.below(25) - 12);
                let (width, height) = (26 + lcg.below(9), 56 + lcg.below(9));
                let who = match i {
                    1 if f >= 30 => 2,
                    2 if f >= 30 => 1,
                    _ => i,
                };
                let id = (100 * who + f / (17 + 9 * who)) as u64;
                output.push(IdentifiedBox { id, bounding_box: rectangle(x + dx, y + dy, width, height) });
            }
            if lcg.below(10) < 6 {
                let (dx, dy) = (lcg.below(31) - 15, lcg.below(31) - 15);
                detections.push(rectangle(x + dx, y + dy, 30, 60));
            }
        }
        if lcg.below(4) == 0 {
            let id = 900 + lcg.below(3) as u64;
            let (x, y) = (lcg.below(200), lcg.below(60));
            output.push(IdentifiedBox { id, bounding_box: rectangle(x, y, 30, 60) });
        }
        (truth, output, detections)
    };
    (0..80).map(frame).collect()
}

/// The figures of motmetrics 1.4.0 for the same boxes, made in Python by the same generator:
/// `MOTAccumulator(auto_id=True)`, `distances.iou_matrix(.., max_iou=1 - min_iou)`, and `mota, idf1, motp,
/// num_objects, num_predictions, num_misses, num_false_positives, num_switches` of
/// `metrics.create().compute`; its `motp` is the mean of one minus the overlap. Detections were compared by
/// `iou_matrix(.., max_iou=0.7)`, and true boxes without a detection were counted.
#[test]
fn agrees_with_motmetrics() {
    let frames = random_case();
    let score_at = |min_iou| score(&frames, min_iou);

    let strict = score_at(0.5);
    assert_near(strict.mota, 0.440_443_213_296_398_9);
    assert_near(strict.idf1, 0.324_734_446_130_500_73);
    assert_near(strict.mean_iou, 1.0 - 0.340_179_391_270_883_5);
    assert_near(strict.misses_recovered, 85.0 / 136.0);
    assert_eq!((strict.true_boxes, strict.output_boxes), (361, 298));
    assert_eq!((strict.misses, strict.false_boxes, strict.switches), (125, 62, 15));
    assert_eq!((strict.missed_detections, strict.recovered_detections), (136, 85));

    let lenient = score_at(0.3);
    assert_near(lenient.mota, 0.684_210_526_315_789_5);
    assert_near(lenient.idf1, 0.388_467_374_810_318_7);
    assert_near(lenient.mean_iou, 1.0 - 0.372_250_720_705_882_5);
    assert_near(lenient.misses_recovered, 106.0 / 136.0);
    assert_eq!((lenient.misses, lenient.false_boxes, lenient.switches), (82, 19, 13));
}

#[test]
fn the_truth_itself_is_faultless() {
    let score = score(&two_people(), 0.5);
    assert_eq!((score.mota, score.idf1, score.mean_iou), (Some(1.0), Some(1.0), Some(1.0)));
    assert_eq!((score.misses, score.false_boxes, score.switches), (0, 0, 0));
    assert_eq!(score.misses_recovered, None);
}

#[test]
fn exchanged_ids_are_two_switches() {
    let mut frames = two_people();
    for (_, output, _) in &mut frames[6..] {
        for b in output {
            b.id = 141 - b.id;
        }
    }
    let score = score(&frames, 0.5);
    assert_eq!((score.misses, score.false_boxes, score.switches), (0, 0, 2));
    assert_near(score.mota, 1.0 - 2.0 / 20.0);
    // Each id is correct in six of ten frames.
    assert_near(score.idf1, 12.0 / 20.0);
}

#[test]
fn a_track_that_is_lost_and_found_under_another_id_is_a_switch() {
    let mut frames = two_people();
    for (_, output, _) in &mut frames[3..6] {
        output.retain(|b| b.id != 71);
    }
    for (_, output, _) in &mut frames[6..] {
        output[1].id = 90;
    }
    let score = score(&frames, 0.5);
    assert_eq!((score.misses, score.false_boxes, score.switches), (3, 0, 1));
    assert_near(score.mota, 1.0 - 4.0 / 20.0);
    // The second person is tracked for three frames under one id, and for four under the other.
    assert_near(score.idf1, 2.0 * 14.0 / 37.0);
}

#[test]
fn a_partner_is_kept_while_it_overlaps_even_beside_a_better_box() {
    let still = |id, x| IdentifiedBox { id, bounding_box: rectangle(x, 0, 100, 100) };
    let frames: Vec<Frame> = vec![
        (vec![still(0, 0)], vec![still(5, 0)], vec![]),
        (vec![still(0, 0)], vec![still(4, 0), still(5, 20)], vec![]),
    ];
    let score = score(&frames, 0.5);
    assert_eq!((score.switches, score.false_boxes), (0, 1));
    assert_near(score.mean_iou, f64::midpoint(1.0, 80.0 / 120.0));
}

#[test]
fn more_pairs_come_before_better_ones() {
    // The best pair overlaps by 0.96; without it, two pairs of 0.35 each are possible.
    let at = |id, x| IdentifiedBox { id, bounding_box: rectangle(x, 0, 100, 100) };
    let frames = [(vec![at(0, 0), at(1, 50)], vec![at(5, 2), at(6, -48)], vec![])];
    let score = score(&frames, 0.3);
    assert_eq!((score.misses, score.false_boxes), (0, 0));
    assert_near(score.mean_iou, 52.0 / 148.0);
}

#[test]
fn ghosts_and_misses_count_one_each() {
    let mut frames = two_people();
    frames[2].1.push(IdentifiedBox { id: 99, bounding_box: rectangle(600, 0, 30, 30) });
    frames[4].1.clear();
    let score = score(&frames, 0.5);
    assert_eq!((score.misses, score.false_boxes, score.switches), (2, 1, 0));
    assert_near(score.mota, 1.0 - 3.0 / 20.0);
    assert_near(score.idf1, 36.0 / 39.0);
}

#[test]
fn boxes_cut_in_half_are_at_the_threshold_and_not_below_it() {
    let mut frames = two_people();
    for (truth, output, _) in &mut frames {
        for (t, o) in truth.iter().zip(output) {
            let b = t.bounding_box;
            o.bounding_box = BoundingBox::new(b.x_min(), b.y_min(), b.x_max(), b.y_min() + 60.0).unwrap();
        }
    }
    assert_eq!(score(&frames, 0.5).mota, Some(1.0));
    assert_eq!(score(&frames, 0.51).mota, Some(-1.0));
}

#[test]
fn recovered_is_what_the_detector_missed_and_the_output_covers() {
    let mut frames = two_people();
    // Missed four times; not recovered when its box has drifted away, nor when it is not output.
    for frame in [2, 3, 4, 5] {
        frames[frame].2.remove(1);
    }
    frames[4].1[1].bounding_box = rectangle(400, 50, 40, 120);
    frames[5].1.remove(1);
    // A box on nobody recovers nothing, and a poor detection (IoU 1/3) is not a miss.
    frames[7].1[0].bounding_box = rectangle(500, 0, 10, 10);
    frames[8].2[0] = rectangle(10 + 24 + 20, 50, 40, 120);
    let score = score(&frames, 0.5);
    assert_eq!((score.missed_detections, score.recovered_detections), (4, 2));
    assert_eq!(score.misses_recovered, Some(0.5));

    // Frames without given detections are not counted.
    let mut scorer = TrackingScorer::new();
    for (truth, output, _) in &frames {
        scorer.add_frame(truth, output, None).unwrap();
    }
    assert_eq!(scorer.score().misses_recovered, None);
    assert_eq!(scorer.score().mota, score.mota);
}

#[test]
fn things_that_are_ignored_neither_help_nor_harm() {
    let frames = two_people();
    let score = |ignore: fn(usize) -> bool, keep_output: bool| {
        let mut scorer = TrackingScorer::new();
        for (f, (truth, output, detections)) in frames.iter().enumerate() {
            // The second person is ignored in some frames.
            let ignored = if ignore(f) { vec![truth[1].bounding_box] } else { vec![] };
            let (asked, put_out) = (truth.len() - ignored.len(), if keep_output { 2 } else { 1 });
            let (truth, output) = (&truth[..asked], &output[..put_out]);
            scorer.add_frame_ignoring(&ignored, truth, output, Some(detections)).unwrap();
        }
        scorer.score()
    };
    for keep_output in [true, false] {
        let all = score(|_| true, keep_output);
        assert_eq!((all.mota, all.idf1), (Some(1.0), Some(1.0)), "{all:?}");
        assert_eq!((all.true_boxes, all.output_boxes), (10, 10));
    }
    let some = score(|f| f < 4, true);
    assert_eq!((some.mota, some.true_boxes, some.output_boxes), (Some(1.0), 16, 16));
    let missed = score(|f| f < 4, false);
    assert_eq!((missed.misses, missed.false_boxes), (6, 0));

    // A box paired with a true box is not left out for an ignored box beside it.
    let still = |id, x| IdentifiedBox { id, bounding_box: rectangle(x, 0, 100, 100) };
    let mut scorer = TrackingScorer::new();
    scorer.add_frame_ignoring(&[rectangle(20, 0, 100, 100)], &[still(0, 0)], &[still(0, 2)], None).unwrap();
    assert_eq!(scorer.score().mota, Some(1.0));
}

#[test]
fn nothing_scores_nothing() {
    let scorer = TrackingScorer::new();
    let score = scorer.score();
    assert_eq!((score.mota, score.idf1, score.misses_recovered, score.mean_iou), (None, None, None, None));

    let empty = rectangle(3, 3, 0, 0);
    let nobody = self::score(&[(vec![], vec![IdentifiedBox { id: 0, bounding_box: empty }], vec![])], 0.5);
    assert_eq!((nobody.mota, nobody.idf1, nobody.false_boxes), (None, Some(0.0), 1));

    // Empty boxes overlap nothing, not even themselves; huge boxes overlap.
    let all = |bounding_box| vec![IdentifiedBox { id: u64::MAX, bounding_box }];
    assert_eq!(self::score(&[(all(empty), all(empty), vec![empty])], 0.5).mota, Some(-1.0));
    let huge = BoundingBox::new(-1e38, -1e38, 1e38, 1e38).unwrap();
    assert_eq!(self::score(&[(all(huge), all(huge), vec![huge])], 0.5).mota, Some(1.0));
}

#[test]
fn refused_frames_change_nothing() {
    let frames = two_people();
    let mut scorer = TrackingScorer::new();
    scorer.add_frame(&frames[0].0, &frames[0].1, Some(&frames[0].2)).unwrap();
    let before = scorer.score();
    let (once, twice) = (&frames[1].0[..], [frames[1].0[0], frames[1].0[0]]);
    let error = scorer.add_frame(once, &twice, Some(&[])).unwrap_err();
    assert_eq!(error, TrackingScoreError::DuplicateId { what: "output boxes", id: 0 });
    assert_eq!(error.to_string(), "output boxes of one frame have the id 0 twice");
    assert!(scorer.add_frame(&twice, once, None).is_err());
    assert_eq!(scorer.score(), before);

    for min_iou in [0.0, f64::NAN] {
        assert_eq!(TrackingScorer::with_min_iou(min_iou).unwrap_err().field, "min_iou");
    }
}

/// Shuffles values.
fn shuffled<T>(values: &mut [T], lcg: &mut Lcg) {
    for i in (1..values.len()).rev() {
        values.swap(i, lcg.below(i as u64 + 1) as usize);
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(32))]

    /// Neither the order of boxes in a frame nor the values of ids matter.
    #[test]
    fn order_and_names_do_not_matter(seed in any::<u64>()) {
        let mut frames = random_case();
        let expected = score(&frames, 0.5);
        let mut lcg = Lcg(seed);
        for (truth, output, detections) in &mut frames {
            shuffled(truth, &mut lcg);
            shuffled(output, &mut lcg);
            shuffled(detections, &mut lcg);
            for b in truth {
                b.id += 1 << 40;
            }
            for b in output {
                b.id += seed >> 1;
            }
        }
        let actual = score(&frames, 0.5);
        prop_assert_eq!(actual, expected);
    }
}
