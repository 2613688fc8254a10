use std::path::Path;

use dymlm::core::Pose;
use dymlm::{MapBuilder, MapConfig};
use dymlm_examples::{AnyError, FrameSource, SourceFrame, progress_bar};
use dymlm_io::TumOptions;

use crate::follow::{Followed, Follower};

/// Follows the nearest object of a label through a recording, from `map_until` seconds on.
pub(crate) fn follow(
    dataset: &Path,
    label: &str,
    map_until: f64,
    has_depth: bool,
) -> Result<Followed, AnyError> {
    let mut source = FrameSource::recorded(dataset, None, &TumOptions::default())?;
    let bar = progress_bar(source.len(), "following");
    let mut builder = Some(MapBuilder::new(MapConfig::default())?);
    let mut follower: Option<Follower> = None;
    let (mut begin, mut last) = (None, None);
    let middle = source.len() / 2;
    for index in 0..source.len() {
        bar.inc(1);
        // A frame that cannot be loaded is passed over.
        let Ok(next) = source.load(index) else { continue };
        let SourceFrame { frame, detections, world_from_camera } = &next;
        let begin = *begin.get_or_insert(frame.timestamp());
        if let Some(follower) = &mut follower {
            follower.step(frame, detections, world_from_camera)?;
            if index == middle {
                follower.picture("in the middle", frame, world_from_camera);
            }
        } else if let Some(mut mapping) = builder.take() {
            mapping.insert(frame, detections, world_from_camera)?;
            if frame.timestamp() - begin >= map_until {
                let object = nearest(&mapping, label, world_from_camera)
                    .ok_or_else(|| format!("no {label} in the map after {map_until} s"))?;
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
    let mut follower = follower.ok_or("the recording ends before an object is chosen")?;
    if let Some(last) = &last {
        follower.picture("at the end", &last.frame, &last.world_from_camera);
    }
    Ok(follower.finish(None))
}

fn nearest(builder: &MapBuilder, label: &str, world_from_camera: &Pose) -> Option<u64> {
    let eye = world_from_camera.translation();
    let distance = |center: [f64; 3]| (0..3).map(|i| (center[i] - eye[i]).powi(2)).sum::<f64>();
    let objects = builder.map().objects().with_label(label);
    objects
        .map(|object| (distance(object.oriented_box().center()), object.id()))
        .min_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, id)| id)
}
