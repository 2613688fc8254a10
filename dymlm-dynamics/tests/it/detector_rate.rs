//! A detector slower than the camera costs neither masks nor boxes.
use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, PinholeCamera, Pose, SensorModel};
use dymlm_dynamics::{DynamicsConfig, Preprocessor};
use dymlm_sim::{Sequence, SequenceType, SimulatedFrame};

/// How well masks and boxes hold the people.
#[derive(Debug, Default)]
struct Quality {
    /// Readings of people, how many of them are masked, and masked readings of anything.
    people: usize,
    held: usize,
    masked: usize,
    /// Sum of the greatest intersection over union of each true box, and their number.
    overlap: f64,
    boxes: usize,
}

impl Quality {
    fn recall(&self) -> f64 {
        self.held as f64 / self.people as f64
    }

    fn precision(&self) -> f64 {
        self.held as f64 / self.masked as f64
    }

    fn box_iou(&self) -> f64 {
        self.overlap / self.boxes as f64
    }

    fn add(&mut self, preprocessor: &Preprocessor, truth: &SimulatedFrame) {
        let is_static = preprocessor.static_mask();
        let depth = truth.frame.depth();
        for v in 0..depth.height() {
            for u in (0..depth.width()).filter(|&u| depth.at(u, v) > 0.0) {
                let (person, masked) = (truth.mover_mask.at(u, v), !is_static.at(u, v));
                self.people += usize::from(person);
                self.held += usize::from(person && masked);
                self.masked += usize::from(masked);
            }
        }
        for person in truth.visible_things.iter().filter(|thing| thing.moves && thing.label == "person") {
            let iou = |own: &BoundingBox| own.iou(&person.bounding_box);
            let movers = preprocessor.movers().iter().map(|mover| iou(&mover.corrected_box));
            self.overlap += movers.fold(0.0, f64::max);
            self.boxes += 1;
        }
    }
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn ten_detections_a_second_are_as_good_as_thirty() {
    let mut config = SequenceType::WalkingXyz.config();
    config.camera = Some(PinholeCamera::new(320, 240, 262.5, 262.5, 159.5, 119.5).unwrap());
    (config.frame_rate, config.frames) = (30.0, 120);
    let sequence = Sequence::new(&config).unwrap();
    let run = |every: usize, without: Option<&[_]>| {
        let mut preprocessor = Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect()).unwrap();
        let mut quality = Quality::default();
        for (index, truth) in sequence.frames().enumerate() {
            let found = if index % every == 0 { Some(&truth.detections[..]) } else { without };
            preprocessor.process(&truth.frame, found, &truth.world_from_camera).unwrap();
            quality.add(&preprocessor, &truth);
        }
        println!("{:.4} {:.4} {:.4}", quality.recall(), quality.precision(), quality.box_iou());
        quality
    };
    let (all, third, empty) = (run(1, None), run(3, None), run(3, Some(&[])));
    assert!(third.recall() >= 0.99 * all.recall(), "{all:?} {third:?}");
    assert!(third.precision() >= 0.95 * all.precision(), "{all:?} {third:?}");
    assert!(third.box_iou() >= 0.95 * all.box_iou(), "{all:?} {third:?}");
    // Without the difference between "not run" and "nothing found" people would be lost.
    assert!(empty.recall() < third.recall(), "{empty:?} {third:?}");
}

/// Columns and rows of a part of the scene.
type Part = [[usize; 2]; 2];

/// Somebody's body and leg, and their box.
const SITTER: [Part; 2] = [[[200, 280], [60, 260]], [[200, 228], [260, 420]]];
const SITTERS_BOX: [f32; 4] = [200.0, 60.0, 280.0, 420.0];
/// Something beside the leg.
const THING: Part = [[232, 280], [270, 350]];

fn is_in(part: &Part, u: usize, v: usize) -> bool {
    let [columns, rows] = part;
    (columns[0]..columns[1]).contains(&u) && (rows[0]..rows[1]).contains(&v)
}

fn is_of_sitter(u: usize, v: usize) -> bool {
    SITTER.iter().any(|part| is_in(part, u, v))
}

/// What a camera at rest reads of somebody at 2 m before a wall, one side turned towards it by `turn` metres,
/// the other away, and of the thing at its depth, metres.
fn frame(timestamp: f64, turn: f64, thing: Option<f32>) -> Frame {
    let depth = |u: usize, v: usize| match thing {
        _ if is_of_sitter(u, v) => (2.0 + turn * (u as f64 - 240.0) / 40.0) as f32,
        Some(depth) if is_in(&THING, u, v) => depth,
        _ => 3.0,
    };
    let depths = (0..640 * 480).map(|pixel| depth(pixel % 640, pixel / 640)).collect();
    let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5).unwrap();
    Frame::new(timestamp, camera, DepthImage::new(640, 480, depths).unwrap(), None).unwrap()
}

fn sitters_detection() -> Detection {
    let [left, top, right, bottom] = SITTERS_BOX;
    Detection::new("person", 0.9, BoundingBox::new(left, top, right, bottom).unwrap()).unwrap()
}

/// Share of the sitter's readings that the mask of static pixels, and that of movers, holds.
fn shares_of_sitter(preprocessor: &Preprocessor) -> [f64; 2] {
    let [is_static, is_mover] = [preprocessor.static_mask(), preprocessor.mover_mask()];
    let pixels = || (0..480).flat_map(|v| (0..640).map(move |u| (u, v))).filter(|&(u, v)| is_of_sitter(u, v));
    [is_static, is_mover].map(|mask| {
        let held = pixels().filter(|&(u, v)| mask.at(u, v)).count();
        held as f64 / pixels().count() as f64
    })
}

/// Regression: when the detector ran in every third frame, the thing that moves was taken for the person in
/// the frames between, and the person for a part of the room.
#[test]
fn who_hardly_moves_while_a_thing_in_the_box_does_is_masked_in_each_frame() {
    let mut preprocessor = Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect()).unwrap();
    for index in 0..90 {
        let time = f64::from(index) / 15.0;
        let swing = if index / 8 % 2 == 0 { 2.42 } else { 2.5 };
        let frame = frame(time, 0.03 * (std::f64::consts::TAU * time / 3.0).sin(), Some(swing));
        let found = [sitters_detection()];
        let found = (index % 3 == 0).then_some(&found[..]);
        preprocessor.process(&frame, found, &Pose::identity()).unwrap();
        let is_static = shares_of_sitter(&preprocessor)[0];
        assert!(is_static < 0.05, "frame {index}: {is_static}");
    }
}

/// Regression: only frames with detections said that a place was a mover's, while every frame said what it
/// took for static. With a detector in every fifteenth frame, sitting people stayed in the cloud.
#[test]
fn a_frame_on_which_the_detector_did_not_run_says_as_surely_what_is_a_movers() {
    // A detection in each of ten frames, then what a further detector says in each frame to come.
    let run = |later: &[Option<&[Detection]>]| {
        let mut preprocessor = Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect()).unwrap();
        let found = [sitters_detection()];
        let all = [Some(&found[..]); 10].into_iter().chain(later.iter().copied());
        for (index, found) in all.enumerate() {
            let frame = frame(index as f64 / 30.0, 0.0, None);
            preprocessor.process(&frame, found, &Pose::identity()).unwrap();
        }
        shares_of_sitter(&preprocessor)
    };
    for frames in [1, 5] {
        let [is_static, is_mover] = run(&vec![None; frames]);
        assert!(is_static == 0.0 && is_mover > 0.95, "{frames} frames: {is_static} {is_mover}");
    }
    // Somebody at 2 m may have gone farther than the box is wide.
    assert_eq!(run(&[None; 20]), [0.0, 0.0]);
    // A detector that ran and found nobody leaves it open whether the person is still there, also in the
    // frames after that.
    assert_eq!(run(&[Some(&[])]), [0.0, 0.0]);
    assert_eq!(run(&[Some(&[]), None, None]), [0.0, 0.0]);
}
