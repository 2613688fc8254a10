//! Compares the simulated detector with a real one: YOLOX-Nano on a recording of people with exact masks.
use dymlm_core::{Detection, PinholeCamera};
use dymlm_sim::{DetectionRates, DetectorConfig, SensorConfig, Sequence, SequenceConfig, SimulatedFrame};
use dymlm_test_support::{DetectorFigures, DetectorStatistics, ExactView, recorded_frames, recording};

/// What `DetectorStatistics` measures on the recording (YOLOX-Nano, score >= 0.25; 200 frames of 640x480 at 6
/// Hz with 202 views of two people), committed for machines without the recording.
struct Recorded {
    /// Number of views below 1.6 %, up to 5 %, up to 10 % of the image, and above.
    views: [usize; 4],
    /// Share of these views found at score 0.25, 0.5, 0.7.
    found: [[f64; 3]; 4],
    score_quartiles: [f64; 3],
    iou: [f64; 2],
    /// Median distance of the left, right and lower side from the exact one, and share of sides cut by more
    /// than a tenth of the extent.
    distance: [f64; 3],
    cut: [f64; 3],
    pixels_outside: f64,
    surplus: f64,
    mean_burst: f64,
}

const RECORDED: Recorded = Recorded {
    views: [12, 54, 76, 60],
    found: [[0.25, 0.083, 0.0], [0.926, 0.833, 0.611], [0.961, 0.934, 0.829], [1.0, 1.0, 1.0]],
    score_quartiles: [0.771, 0.833, 0.884],
    iou: [0.859, 0.674],
    distance: [0.0328, 0.0368, 0.0347],
    cut: [0.089, 0.160, 0.315],
    pixels_outside: 0.0257,
    surplus: 0.0545,
    mean_burst: 1.333,
};

impl Recorded {
    fn of(figures: &DetectorFigures) -> Self {
        let [left, _, right, low] = figures.sides;
        let size = |k: usize| figures.by_size[k];
        Self {
            views: std::array::from_fn(|k| size(k).views),
            found: std::array::from_fn(|k| size(k).found),
            score_quartiles: figures.score_quartiles,
            iou: figures.iou,
            distance: [left, right, low].map(|side| side.distance[0]),
            cut: [left, right, low].map(|side| side.cut),
            pixels_outside: figures.pixels_outside,
            surplus: figures.surplus,
            mean_burst: figures.mean_burst,
        }
    }
}

#[track_caller]
fn assert_near(what: &str, value: f64, expected: f64, tolerance: f64) {
    assert!((value - expected).abs() <= tolerance, "{what}: {value}, expected {expected} +- {tolerance}");
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn the_committed_figures_are_those_of_the_recording() {
    let Some(folder) = recording("kitchen_people") else { return };
    let mut statistics = DetectorStatistics::new("person");
    for recorded in recorded_frames(&folder) {
        let views: Vec<ExactView> =
            (0..2_u8).filter_map(|id| ExactView::of_mask(id.into(), &recorded.person(id + 1))).collect();
        statistics.add(&recorded.detections, &views, &recorded.people());
    }
    let figures = statistics.figures().unwrap();
    let real = Recorded::of(&figures);
    assert_eq!((figures.frames, figures.views, figures.boxes), (200, 202, 197));
    assert_eq!(figures.bursts, [10, 0, 2]);
    assert_eq!(real.views, RECORDED.views);
    let pairs = real.found.iter().flatten().zip(RECORDED.found.iter().flatten());
    pairs.for_each(|(&real, &committed)| assert_near("found", real, committed, 6e-4));
    let numbers = |r: &Recorded| {
        [&r.score_quartiles[..], &r.iou, &r.distance, &r.cut, &[r.pixels_outside, r.surplus, r.mean_burst]]
            .concat()
    };
    for (real, committed) in numbers(&real).into_iter().zip(numbers(&RECORDED)) {
        assert_near("a figure", real, committed, 6e-4);
    }
}

/// The movers in view with their exact boxes.
fn mover_views(frame: &SimulatedFrame) -> Vec<ExactView> {
    let movers = frame.visible_things.iter().filter(|thing| thing.moves);
    movers.map(|thing| ExactView::new(thing.id, thing.bounding_box, thing.pixels)).collect()
}

/// Compares the defaults with the recording where it has data. The tolerances cover the uncertainty of so few
/// views and differences of the scenes (in the recording, feet and lower legs are mostly behind a table;
/// here, below the image).
#[test]
fn the_defaults_are_like_the_recording() {
    let mut statistics = DetectorStatistics::new("person");
    for seed in 0..7 {
        let mut config = with_camera(160, 120);
        config.seed = seed;
        config.frames = 200;
        config.frame_rate = 6.0;
        for frame in Sequence::new(&config).unwrap().frames() {
            statistics.add(&frame.detections, &mover_views(&frame), &frame.mover_mask);
        }
    }
    let figures = statistics.figures().unwrap();
    for row in figures.rows() {
        eprintln!("{:58} {:8.2}", row.name, row.value);
    }
    let simulated = Recorded::of(&figures);
    for size in 0..4 {
        for score in 0..3 {
            let share = RECORDED.found[size][score];
            let sigma = (share.clamp(0.02, 0.98) * (1.0 - share.clamp(0.02, 0.98))
                / RECORDED.views[size] as f64)
                .sqrt();
            let what = format!("found in size class {size} at score class {score}");
            assert_near(&what, simulated.found[size][score], share, 0.02 + 2.0 * sigma);
        }
    }
    for (k, quartile) in RECORDED.score_quartiles.iter().enumerate() {
        assert_near("score", simulated.score_quartiles[k], *quartile, 0.03);
    }
    assert_near("median IoU", simulated.iou[0], RECORDED.iou[0], 0.08);
    assert_near("IoU of nine tenths", simulated.iou[1], RECORDED.iou[1], 0.12);
    for side in 0..3 {
        assert_near("distance of a side", simulated.distance[side], RECORDED.distance[side], 0.015);
        assert_near("cut sides", simulated.cut[side], RECORDED.cut[side], 0.1);
    }
    let sides = |r: &Recorded| 0.5 * (r.cut[0] + r.cut[1]);
    assert_near("cut left and right sides", sides(&simulated), sides(&RECORDED), 0.04);
    assert_near("pixels outside", simulated.pixels_outside, RECORDED.pixels_outside, 0.015);
    assert_near("surplus boxes", simulated.surplus, RECORDED.surplus, 0.02);
    assert_near("length of a burst", simulated.mean_burst, RECORDED.mean_burst, 0.6);
}

/// Frames of long sequences with a tiny camera and an exact detector, changed by `change`, to measure rates.
fn long_run(change: impl Fn(&mut DetectorConfig)) -> impl Iterator<Item = SimulatedFrame> {
    let mut config = with_camera(64, 48);
    config.detector = DetectorConfig::ideal();
    change(&mut config.detector);
    (0..4).flat_map(move |seed| {
        let mut config = config.clone();
        config.seed = seed;
        config.frames = 300;
        // The frames are so far apart in time that they are almost independent.
        config.frame_rate = 2.0;
        Sequence::new(&config).unwrap().frames().collect::<Vec<_>>()
    })
}

fn with_camera(width: usize, height: usize) -> SequenceConfig {
    let mut config = SequenceConfig::default();
    config.sensor = SensorConfig::ideal();
    let (f, [cx, cy]) = (0.82 * width as f64, [width, height].map(|side| 0.5 * (side as f64 - 1.0)));
    config.camera = Some(PinholeCamera::new(width, height, f, f, cx, cy).unwrap());
    config
}

fn people(frames: impl Iterator<Item = SimulatedFrame>) -> DetectorFigures {
    let mut statistics = DetectorStatistics::new("person");
    frames.for_each(|frame| statistics.add(&frame.detections, &mover_views(&frame), &frame.mover_mask));
    statistics.figures().unwrap()
}

#[test]
fn without_errors_every_view_is_framed_exactly() {
    let figures = people(long_run(|_| ()));
    assert!(figures.views > 500);
    assert_eq!((figures.found[0], figures.iou, figures.pixels_outside), (1.0, [1.0, 1.0], 0.0));
    assert_eq!((figures.surplus, figures.bursts.len()), (0.0, 0));
}

#[test]
fn scores_have_their_shares() {
    let figures = people(long_run(|c| c.movers = DetectionRates::new(0.1, 0.25, 0.45)));
    for (found, expected) in figures.found.iter().zip([0.9, 0.75, 0.55]) {
        assert_near("found", *found, expected, 0.04);
    }
}

#[test]
fn larger_views_are_found_more_often() {
    let figures = people(long_run(|c| {
        c.movers = DetectionRates::new(0.2, 0.3, 0.5);
        c.movers.size_gain = 0.5;
    }));
    let found: Vec<f64> = figures.by_size.iter().map(|size| size.found[0]).collect();
    assert!(found.len() == 4 && found.is_sorted(), "{found:?}");
    assert!(found[3] - found[0] > 0.4, "{found:?}");
}

#[test]
fn sides_jitter_and_are_cut_at_their_rates() {
    let inwards = |change: fn(&mut DetectorConfig)| {
        let sides = people(long_run(change)).sides;
        [sides[0], sides[1], sides[2], sides[3]]
    };
    let cut = inwards(|c| (c.cut_rate, c.low_cut_rate, c.cut_depth) = (0.2, 0.4, 0.45));
    for (side, rate) in [(0, 0.2), (2, 0.2), (3, 0.4)] {
        // The shallowest cuts, 9 % of the extent, are not counted.
        assert_near("cut", cut[side].cut, 0.97 * rate, 0.08);
        assert_eq!(cut[side].quantiles[0], 0.0);
    }
    assert_eq!(cut[1].cut, 0.0);

    let jitter = inwards(|c| c.box_jitter = 0.02);
    for side in [0, 2] {
        // Boxes are about twice as high as wide, so the root of the area is 1.4 widths; 5 % of the sides are
        // more than 1.64 sigma off.
        let quantiles = jitter[side].quantiles;
        assert!(
            (-0.08..-0.03).contains(&quantiles[0]) && (0.03..0.08).contains(&quantiles[4]),
            "{quantiles:?}"
        );
        assert!(quantiles[2].abs() < 0.004, "{quantiles:?}");
    }
}

#[test]
fn surplus_and_invented_boxes_come_at_their_rates() {
    let figures = people(long_run(|c| c.surplus_rate = 0.2));
    // A few surplus boxes match another person in view so well that they count as that person's box; no view
    // is missed.
    assert_near("surplus", figures.surplus, 0.2, 0.02);
    assert_eq!(figures.found[0], 1.0);

    let (mut invented, mut frames) = (0, 0);
    for frame in long_run(|c| c.invented_rate = 0.3) {
        frames += 1;
        let known = |d: &&Detection| frame.visible_things.iter().any(|thing| thing.label == d.label());
        invented += frame.detections.len() - frame.detections.iter().filter(known).count();
        assert!(frame.detections.len() <= frame.visible_things.len() + 1);
    }
    // Some invented boxes have the label of a thing in view, and are not counted.
    let share = invented as f64 / f64::from(frames);
    assert!((0.15..0.33).contains(&share), "{share} a frame");
}

#[test]
fn labels_are_confused_at_their_rate_and_people_are_not() {
    let (mut named, mut things) = (0, 0);
    for frame in long_run(|c| c.confusion_rate = 0.25) {
        for thing in &frame.visible_things {
            let rightly = frame
                .detections
                .iter()
                .any(|d| d.label() == thing.label && d.bounding_box() == thing.bounding_box);
            assert!(rightly || !thing.moves);
            named += usize::from(rightly && !thing.moves);
            things += usize::from(!thing.moves);
        }
    }
    assert_near("rightly named", named as f64 / things as f64, 0.75, 0.03);
}

#[test]
fn of_boxes_of_one_label_that_overlap_much_one_remains() {
    let overlaps = |frame: &SimulatedFrame| {
        let boxes: Vec<_> = frame.detections.iter().filter(|d| d.label() == "person").collect();
        boxes.len() == 2 && boxes[0].bounding_box().iou(&boxes[1].bounding_box()) > 0.3
    };
    let all = long_run(|_| ()).filter(overlaps).count();
    let merged = long_run(|c| c.merged_overlap = 0.3).filter(overlaps).count();
    assert!(all > 10, "people cross in {all} frames");
    assert_eq!(merged, 0);
}

#[test]
fn misses_come_in_bursts_of_the_set_length() {
    let mean = |burst_time: f64| {
        let mut config = with_camera(64, 48);
        config.detector = DetectorConfig::ideal();
        config.detector.movers = DetectionRates::new(0.2, 0.2, 0.2);
        config.detector.burst_time = burst_time;
        config.frames = 2000;
        config.frame_rate = 10.0;
        people(Sequence::new(&config).unwrap().frames()).mean_burst
    };
    // With a miss rate of one in five, independent misses come in bursts of 1.25 frames.
    let (short, long) = (mean(0.01), mean(1.0));
    assert_near("short bursts", short, 1.25, 0.15);
    assert!(long > 4.0 * short, "{long} against {short} frames");
}
