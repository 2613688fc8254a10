//! A detector slower than the camera costs neither masks nor boxes.
use dymlm_core::{BoundingBox, PinholeCamera, SensorModel};
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
