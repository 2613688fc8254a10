use std::path::Path;

use dymlm::core::{Frame, ObjectId, Pose};
use dymlm::objects::MapObject;
use dymlm::tracking::ObjectTrackerConfig;
use dymlm::{MapBuilder, MapConfig};
use dymlm_examples::{AnyError, FrameSource, SourceFrame, progress_bar};
use dymlm_io::TumOptions;

use crate::follow::{Followed, Follower};

/// Follows the nearest object of a label through a recording, starting at the first frame that shows one
/// completely, but not before `map_until` seconds.
pub(crate) fn follow(
    dataset: &Path,
    label: &str,
    map_until: f64,
    has_depth: bool,
) -> Result<Followed, AnyError> {
    let mut source = FrameSource::recorded(dataset, None, &TumOptions::default())?;
    let bar = progress_bar(source.len(), "following");
    // The object may be picked up within the first second, so every frame is mapped.
    let mut builder = Some(MapBuilder::new(MapConfig::offline())?);
    let mut follower: Option<Follower> = None;
    let (mut begin, mut last) = (None, None);
    let middle = source.len() / 2;
    for index in 0..source.len() {
        bar.inc(1);
        // A frame that cannot be loaded is skipped.
        let Ok(next) = source.load(index) else { continue };
        let SourceFrame { frame, detections, world_from_camera } = &next;
        let begin = *begin.get_or_insert(frame.timestamp());
        if let Some(follower) = &mut follower {
            follower.step(frame, detections.as_deref(), world_from_camera)?;
            if index == middle {
                follower.picture("in the middle", frame, world_from_camera);
            }
        } else if let Some(mut mapping) = builder.take() {
            mapping.insert(frame, detections.as_deref(), world_from_camera)?;
            let object = if frame.timestamp() - begin >= map_until {
                // Following may fail from this frame, if too little of the object is seen.
                nearest_in_view(&mapping, label, frame, world_from_camera).filter(|&object| {
                    let config = ObjectTrackerConfig::default();
                    mapping.track_object(object, frame, world_from_camera, &config).is_ok()
                })
            } else {
                None
            };
            if let Some(object) = object {
                let mut chosen = Follower::new(mapping, object, frame, world_from_camera, has_depth)?;
                chosen.picture("object map", frame, world_from_camera);
                follower = Some(chosen);
            } else {
                builder = Some(mapping);
            }
        }
        last = Some(next);
    }
    bar.finish_and_clear();
    let mut follower =
        follower.ok_or_else(|| format!("no {label} of the map comes into view after {map_until} s"))?;
    if let Some(last) = &last {
        follower.picture("at the end", &last.frame, &last.world_from_camera);
    }
    Ok(follower.finish(None))
}

/// The nearest object of a label that is completely in the image and not occluded.
fn nearest_in_view(
    builder: &MapBuilder,
    label: &str,
    frame: &Frame,
    world_from_camera: &Pose,
) -> Option<ObjectId> {
    let (camera, camera_from_world) = (frame.camera(), world_from_camera.inverse());
    let pixel_of = |place: [f64; 3]| camera.project(camera_from_world.transform_point(place));
    let is_seen = |object: &MapObject| {
        let body = object.oriented_box();
        let is_on_image = |corner: [f64; 3]| pixel_of(corner).is_some_and(|pixel| camera.sees(pixel));
        let reading = pixel_of(body.center())
            .map_or(0.0, |[u, v]| f64::from(frame.depth().at(u.round() as usize, v.round() as usize)));
        let middle = camera_from_world.transform_point(body.center())[2];
        let reach = 0.5 * body.lengths().iter().map(|length| length * length).sum::<f64>().sqrt();
        body.corners().into_iter().all(is_on_image) && (reading - middle).abs() <= reach
    };
    let distance = |object: &MapObject| camera_from_world.transform_point(object.oriented_box().center())[2];
    let objects = builder.map().objects().with_label(label).filter(|object| is_seen(object));
    objects.map(|object| (distance(object), object.id())).min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, id)| id)
}
