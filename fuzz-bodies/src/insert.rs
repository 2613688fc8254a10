use dymlm::objects::SightedPoint;
use dymlm::planes::MapPlane;
use dymlm::{FrameInput, HistoryConfig, MapBuilder, MapConfig, Selection};
use dymlm_core::{ColorImage, DepthImage, Distortion, Frame, PinholeCamera, Rectifier};

use crate::any_frame::detections;
use crate::choices::Choices;

/// A few frames of any camera and any lens, with any readings, detections, map points and poses. Refused
/// frames must change nothing; all mapped coordinates must be finite.
pub fn insert(bytes: &[u8]) {
    let mut choices = Choices::new(bytes);
    let mut config = MapConfig::default();
    config.history = if choices.is_true() { HistoryConfig::Memory } else { HistoryConfig::None };
    config.cloud.voxel_size = 0.1;
    config.octree.resolution = 0.4;
    config.octree.color = choices.is_true();
    let mut builder = MapBuilder::new(config).unwrap();
    let mut time = 0.0;
    for _ in 0..3 {
        time += if choices.byte() < 240 { 0.2 } else { choices.number() };
        let Some(frame) = frame(&mut choices, time) else { continue };
        let (found, pose) = (detections(&mut choices), choices.pose());
        let points: Vec<SightedPoint> = (0..choices.below(6))
            .map(|_| SightedPoint::new(choices.byte().into(), choices.numbers().map(|c: f64| c as f32)))
            .collect();
        let before = builder.map().counts();
        if builder.insert_frame(&FrameInput::new(&frame, &found, &pose).with_sighted_points(&points)).is_err()
        {
            assert_eq!(builder.map().counts(), before, "what was refused has changed the maps");
        }
    }
    builder.settle();
    let cloud = builder.map().cloud().point_cloud(Selection::Static);
    assert!(cloud.points().iter().flatten().all(|c| c.is_finite()));
    let boxes = builder.map().objects().objects().chain(builder.map().objects().candidates());
    assert!(boxes.flat_map(|object| object.oriented_box().corners()).flatten().all(f64::is_finite));
    let planes = builder.map().planes().iter().chain(builder.map().planes().candidates());
    assert!(planes.flat_map(MapPlane::centroid).all(f64::is_finite));
}

/// A frame of few pixels, most of them at any distance from the one before.
fn frame(choices: &mut Choices<'_>, time: f64) -> Option<Frame> {
    let camera = camera(choices)?;
    let [width, height] = [camera.width(), camera.height()];
    let mut distance = 1.0 + f32::from(choices.byte()) / 64.0;
    let readings = (0..width * height).map(|_| {
        match choices.byte() {
            0..200 => {}
            200..240 => distance += f32::from(choices.byte().cast_signed()) / 128.0,
            240..250 => distance = choices.number() as f32,
            _ => return 0.0,
        }
        distance
    });
    let depth = DepthImage::new(width, height, readings.collect()).ok()?;
    let colors = choices.is_true().then(|| {
        let shade = choices.byte();
        let colors = (0..width * height).map(|i| [shade, i as u8, shade.wrapping_mul(i as u8)]).collect();
        ColorImage::new(width, height, colors).unwrap()
    });
    let frame = Frame::new(time, camera, depth, colors).ok()?;
    if choices.byte() < 200 {
        return Some(frame);
    }
    let lens = match choices.below(2) {
        0 => Distortion::brown_conrady(&choices.numbers::<5>()),
        _ => Distortion::equidistant(choices.numbers()),
    };
    let seen_by = self::camera(choices)?;
    let rectifier = Rectifier::new(&camera, &lens.ok()?, &seen_by);
    let mut depth = DepthImage::new(1, 1, vec![0.0]).unwrap();
    rectifier.rectify_depth(frame.depth(), &mut depth).unwrap();
    Frame::new(time, seen_by, depth, None).ok()
}

fn camera(choices: &mut Choices<'_>) -> Option<PinholeCamera> {
    let [width, height] = [1 + choices.number_below(40), 1 + choices.number_below(30)];
    if choices.byte() < 200 {
        let [cx, cy] = [width, height].map(|side| 0.5 * (side as f64 - 1.0));
        return PinholeCamera::new(width, height, 30.0, 30.0, cx, cy).ok();
    }
    let [fx, fy, cx, cy] = choices.numbers();
    PinholeCamera::new(width, height, 20.0 * fx, 20.0 * fy, cx, cy).ok()
}
