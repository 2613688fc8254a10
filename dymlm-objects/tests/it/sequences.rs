//! Two simulated sequences, short and small, from the detector's boxes to scored objects.
use dymlm_core::{PinholeCamera, SensorModel};
use dymlm_dynamics::{DynamicsConfig, Preprocessor};
use dymlm_metrics::{EstimatedObject, ObjectScore, score_objects};
use dymlm_objects::{MapObject, ObjectConfig, ObjectMapper, ObjectView, SupportPlane};
use dymlm_planes::{PlaneConfig, PlaneMapper};
use dymlm_sim::{Sequence, SequenceType, Truth, TruthConfig};

fn score(kind: SequenceType, frames: usize) -> ObjectScore {
    let mut config = kind.config();
    config.camera = Some(PinholeCamera::new(320, 240, 262.5, 262.5, 159.5, 119.5).unwrap());
    config.frames = frames;
    let sequence = Sequence::new(&config).unwrap();
    let mut preprocessor = Preprocessor::new(DynamicsConfig::default(), SensorModel::kinect()).unwrap();
    let movers = preprocessor.mover_labels().to_vec();
    let mut planes = PlaneMapper::new(PlaneConfig::default(), SensorModel::kinect()).unwrap();
    let mut mapper = ObjectMapper::new(ObjectConfig::default(), SensorModel::kinect()).unwrap();
    let mut truth = Truth::new(&sequence, &TruthConfig::default()).unwrap();
    for simulated in sequence.frames() {
        truth.observe(&simulated);
        let pose = simulated.world_from_camera;
        let mask =
            preprocessor.process(&simulated.frame, Some(&simulated.detections), &pose).unwrap().static_mask;
        planes.insert(&simulated.frame, Some(mask), &[], &pose).unwrap();
        let near = |point: [f64; 3], reach: f64, found: &mut Vec<SupportPlane>| {
            let near = planes.map().supports_near(point, reach);
            found.extend(near.map(|plane| SupportPlane::new(plane.id(), plane.plane())));
        };
        let view = ObjectView::new(&simulated.frame, &simulated.detections, &pose);
        let view = view.with_static_mask(mask).unwrap().without_labels(&movers);
        mapper.insert(&view, &near).unwrap();
    }
    let estimate = |object: &MapObject| EstimatedObject {
        label: object.label().to_owned(),
        world_from_object: object.oriented_box().world_from_box(),
        dimensions: object.oriented_box().lengths(),
    };
    let estimates: Vec<EstimatedObject> = mapper.map().objects().map(estimate).collect();
    let score = score_objects(&estimates, &truth.objects());
    println!(
        "{}: recall {:?}, precision {:?}, IoU {:?}, centre {:?}, label {:?}",
        kind.name(),
        score.recall(),
        score.precision(),
        score.mean_iou,
        score.center_error,
        score.label_accuracy()
    );
    score
}

#[test]
fn walking_people_leave_the_objects_alone() {
    let score = score(SequenceType::WalkingHalfSphere, 45);
    assert!(score.recall().unwrap() >= 0.75 && score.precision().unwrap() >= 0.8);
    assert!(score.mean_iou.unwrap() >= 0.45 && score.label_accuracy().unwrap() >= 0.9);
    assert!(score.center_error.unwrap().median <= 0.05);
    assert!(score.duplicates.is_empty());
}

#[test]
fn sitting_people_hide_some_and_invent_none() {
    let score = score(SequenceType::SittingXyz, 40);
    assert!(score.recall().unwrap() >= 0.6 && score.precision().unwrap() >= 0.75);
    assert!(score.mean_iou.unwrap() >= 0.4 && score.label_accuracy().unwrap() >= 0.9);
}
