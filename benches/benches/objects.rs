//! The object step on 640x480 frames with ten detections, on one thread, measured in processor time.

mod processor_time;

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use dymlm_core::{Detection, Frame, Plane, PlaneId, Pose, SensorModel};
use dymlm_objects::{ObjectConfig, ObjectMapper, ObjectView, SupportPlane};
use dymlm_sim::{DetectorConfig, Sequence, SequenceType};
use processor_time::ProcessorTime;

/// Frames of a desk whose things are all detected, ten per frame, and the frames' poses.
struct Views {
    frames: Vec<(Frame, Vec<Detection>, Pose)>,
}

const FRAMES: usize = 8;
const DETECTIONS: usize = 10;

impl Views {
    #[allow(clippy::unwrap_used, reason = "constants")]
    fn new() -> Self {
        let mut config = SequenceType::WalkingHalfSphere.config();
        config.people = 0;
        config.detector = DetectorConfig::ideal();
        let sequence = Sequence::new(&config).unwrap();
        let frames = (0..FRAMES).filter_map(|index| {
            let mut simulated = sequence.frame(3 * index)?;
            simulated.detections.truncate(DETECTIONS);
            // All frames have the same time, since they are used in a cycle.
            let (depth, color) = simulated.frame.into_images();
            let frame = Frame::new(0.0, *sequence.camera(), depth, color).ok()?;
            Some((frame, simulated.detections, simulated.world_from_camera))
        });
        Self { frames: frames.collect() }
    }

    fn view(&self, step: usize) -> ObjectView<'_> {
        let (frame, detections, pose) = &self.frames[step % self.frames.len()];
        ObjectView::new(frame, detections, pose)
    }
}

/// The floor and the desk as infinite planes.
fn planes() -> impl Fn([f64; 3], f64, &mut Vec<SupportPlane>) {
    let level = |id: u64, height: f64| {
        Plane::new([0.0, 0.0, 1.0], -height).map(|plane| SupportPlane::new(PlaneId::new(id), plane))
    };
    let known: Vec<SupportPlane> = [level(0, 0.01), level(1, 0.74)].into_iter().flatten().collect();
    move |point, reach, found| {
        found.extend(known.iter().filter(|own| own.plane.signed_distance(point).abs() <= reach));
    }
}

#[allow(clippy::unwrap_used, reason = "constants")]
fn insert(criterion: &mut Criterion<ProcessorTime>) {
    let (views, planes) = (Views::new(), planes());
    let mut mapper = ObjectMapper::new(ObjectConfig::default(), SensorModel::kinect()).unwrap();
    for step in 0..3 * FRAMES {
        mapper.insert(&views.view(step), &planes).unwrap();
    }
    let mut step = 0;
    criterion.bench_function("dymlm-objects/insert/ten_detections", |bencher| {
        bencher.iter(|| {
            step += 1;
            black_box(mapper.insert(&views.view(step), &planes).unwrap())
        });
    });
}

/// The map first gets copies of the desk, 20 m apart: objects that are out of view must cost nothing.
#[allow(clippy::unwrap_used, reason = "constants")]
fn insert_with_objects_out_of_view(criterion: &mut Criterion<ProcessorTime>) {
    let (views, planes) = (Views::new(), planes());
    let mut mapper = ObjectMapper::new(ObjectConfig::default(), SensorModel::kinect()).unwrap();
    let mut rooms = 0;
    for objects in [100, 400, 1600] {
        while mapper.map().len() < objects {
            let shift = [20.0 * f64::from(rooms % 16), 20.0 * f64::from(rooms / 16), 0.0];
            let shift = Pose::new(shift, [0.0, 0.0, 0.0, 1.0]).unwrap();
            for (frame, detections, pose) in &views.frames {
                mapper.insert(&ObjectView::new(frame, detections, &(shift * *pose)), &planes).unwrap();
            }
            rooms += 1;
        }
        for step in 0..3 * FRAMES {
            mapper.insert(&views.view(step), &planes).unwrap();
        }
        let mut step = 0;
        criterion.bench_function(&format!("dymlm-objects/insert/{objects}_objects_out_of_view"), |bencher| {
            bencher.iter(|| {
                step += 1;
                black_box(mapper.insert(&views.view(step), &planes).unwrap())
            });
        });
    }
}

criterion_group! {
    name = benches;
    config = Criterion::default().with_measurement(ProcessorTime);
    targets = insert, insert_with_objects_out_of_view
}
criterion_main!(benches);
