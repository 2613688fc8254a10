use dymlm::{Detections, HistoryConfig, MapBuilder, MapConfig};
use dymlm_core::{
    BoundingBox, ColorImage, DepthImage, Detection, Frame, FrameId, Mask, PinholeCamera, Point, Pose,
};

use crate::choices::Choices;

const SIDES: [usize; 2] = [32, 24];
const LABELS: [&str; 5] = ["person", "chair", "dog", "cup", "???"];

/// Calls of a map builder, in any order and with any arguments: small frames, detections, late ones,
/// corrections, scans, what readers ask. What is refused changes nothing.
pub fn map_builder(bytes: &[u8]) {
    let mut choices = Choices::new(bytes);
    let mut config = MapConfig::default();
    config.history = if choices.is_true() { HistoryConfig::Memory } else { HistoryConfig::None };
    config.sensor.stride = 1 + usize::from(choices.below(2));
    // Fine cells are for single cases: most of what may go wrong does not ask how many there are.
    let fineness = choices.byte();
    config.cloud.voxel_size = if fineness < 16 { 0.01 } else { 0.1 };
    config.octree.resolution = if fineness < 16 { 0.05 } else { [0.2, 0.5, 1.0][usize::from(fineness % 3)] };
    config.max_detection_delay = f64::from(choices.below(3)) * 0.2;
    let mut builder = MapBuilder::new(config).unwrap();
    let reader = builder.reader();
    let mut time = 0.0;
    for _ in 0..24 {
        if choices.is_over() {
            break;
        }
        step(&mut builder, &mut choices, &mut time);
        let latest = reader.latest();
        // Counting goes through all maps: done after each step, it takes most of the time.
        if choices.byte() < 16 {
            let _ = (latest.counts(), builder.trajectory().count());
        }
    }
    builder.settle();
    let counts = builder.map().counts();
    let mut map = builder.into_map();
    assert_eq!(map.counts(), counts);
    map = map.clone();
    assert_eq!(map.counts(), counts);
}

fn step(builder: &mut MapBuilder, choices: &mut Choices<'_>, time: &mut f64) {
    // Shares what does not change, and is counted only if the step is refused.
    let before = builder.map().clone();
    let frames = builder.trajectory().count() as u64;
    let id = FrameId::new(if frames > 0 && choices.byte() < 240 {
        u64::from(choices.byte()) % frames
    } else {
        1 << 60
    });
    // Whether the call was refused.
    let refused = match choices.below(12) {
        0..=4 => {
            *time += if choices.byte() < 250 { 0.2 } else { choices.number() };
            let Some(frame) = frame(choices, *time) else { return };
            let found = detections(choices);
            let found = match choices.below(8) {
                0 => Detections::NotRun,
                1 | 2 => Detections::Pending,
                _ => Detections::Found(&found),
            };
            builder.insert(&frame, found, &choices.pose()).is_err()
        }
        5 => builder.detections_for(id, &detections(choices)).is_err(),
        6 => {
            let poses: Vec<(FrameId, Pose)> = (0..=choices.below(3))
                .map(|_| (FrameId::new(u64::from(choices.byte()) % (frames + 1)), choices.pose()))
                .collect();
            builder.correct_poses(&poses).is_err()
        }
        7 => builder.remove(id).is_err(),
        8 => builder.transform(&choices.pose()).is_err(),
        9 => {
            builder.forget_outside(choices.numbers(), choices.number());
            false
        }
        10 => {
            *time += 0.1;
            let points: Vec<Point> =
                (0..choices.below(20)).map(|_| choices.numbers().map(|c: f64| c as f32)).collect();
            builder.insert_scan(*time, &points, &choices.pose()).is_err()
        }
        _ => {
            if choices.is_true() {
                return drop(builder.begin_session().unwrap());
            }
            builder.settle();
            false
        }
    };
    if refused {
        assert_eq!(builder.map().counts(), before.counts(), "what was refused has changed the maps");
    }
}

/// A wall, a floor, things before them, and readings of any value.
fn frame(choices: &mut Choices<'_>, time: f64) -> Option<Frame> {
    let [width, height] = SIDES;
    let camera = PinholeCamera::new(width, height, 26.0, 26.0, 15.5, 11.5).unwrap();
    let wall = 1.0 + f32::from(choices.below(40)) / 10.0;
    let mut depth: Vec<f32> = (0..width * height)
        .map(|i| {
            let down = ((i / width) as f32 - 11.5) / 26.0;
            if down > 0.0 { wall.min(1.2 / down) } else { wall }
        })
        .collect();
    for _ in 0..choices.below(4) {
        let (left, top, z) =
            (usize::from(choices.below(32)), usize::from(choices.below(24)), choices.number() as f32);
        let (right, bottom) = (left + usize::from(choices.below(16)), top + usize::from(choices.below(16)));
        for v in top..bottom.min(height) {
            depth[v * width..][left..right.min(width).max(left)].fill(z);
        }
    }
    let colors = choices.is_true().then(|| {
        let shade = choices.byte();
        ColorImage::new(width, height, (0..width * height).map(|i| [shade, i as u8, 90]).collect()).unwrap()
    });
    Frame::new(time, camera, DepthImage::new(width, height, depth).ok()?, colors).ok()
}

fn detections(choices: &mut Choices<'_>) -> Vec<Detection> {
    let count = if choices.byte() > 252 { 400 } else { usize::from(choices.below(5)) };
    (0..count).filter_map(|_| detection(choices)).collect()
}

fn detection(choices: &mut Choices<'_>) -> Option<Detection> {
    let label = LABELS[usize::from(choices.below(5))];
    let score = f32::from(choices.byte()) / 255.0;
    let bounding_box = if choices.byte() < 220 {
        let [x, y] = [0; 2].map(|_| f32::from(choices.below(40)) - 4.0);
        let [w, h] = [0; 2].map(|_| f32::from(choices.below(30)));
        BoundingBox::new(x, y, x + w, y + h)
    } else {
        let [a, b, c, d] = choices.numbers().map(|c: f64| c as f32);
        BoundingBox::new(a, b, c, d)
    };
    let detection = Detection::new(label, score, bounding_box.ok()?).ok()?;
    if choices.byte() < 200 {
        return Some(detection);
    }
    let [width, height] = if choices.byte() < 250 { SIDES } else { [3, 5] };
    let shift = usize::from(choices.byte());
    let mask = Mask::from_fn(width, height, |u, v| (u * 7 + v * 3 + shift) % 11 < 5).ok()?;
    Some(detection.with_mask(mask))
}
