use std::collections::BTreeMap;
use std::fs;

use dymlm_cloud::{CloudMap, CloudMapConfig, Selection};
use dymlm_core::{Frame, PointCloud, Pose, SensorModel};

use crate::Failure;
use crate::inputs::Inputs;
use crate::planes;
use crate::request::Request;
use crate::results::write_points;
use crate::timing::{Timing, timed};

/// Posed depth images, by the path of the images' file.
#[derive(Default)]
pub(crate) struct Recordings(BTreeMap<String, Vec<(Frame, Pose)>>);

/// `static_cloud images= poses= limit=`: builds the cloud of the first `limit` frames, without detections,
/// and returns its static points.
pub(crate) fn run(
    request: &Request,
    inputs: &mut Inputs,
    recordings: &mut Recordings,
) -> Result<Timing, Failure> {
    let path = request.text("images")?;
    if !recordings.0.contains_key(path) {
        let frames = planes::read(inputs.floats(path)?)?;
        let posed = frames.into_iter().zip(read_poses(request.text("poses")?)?);
        recordings.0.insert(path.to_owned(), posed.collect());
    }
    let frames = recordings.0.get(path).ok_or("no images")?;
    let frames = &frames[..frames.len().min(request.number("limit")?)];

    let (mapped, timing) = timed(|| map(frames));
    let cloud = mapped?;
    if let Some(path) = request.result() {
        write_points(path, cloud.points())?;
    }
    Ok(timing)
}

fn map(frames: &[(Frame, Pose)]) -> Result<PointCloud, dymlm_cloud::Error> {
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect())?;
    for (frame, world_from_camera) in frames {
        map.insert(frame, None, world_from_camera)?;
    }
    Ok(map.point_cloud(Selection::Static))
}

/// Reads the format of `harness/files.py`.
fn read_poses(path: &str) -> Result<Vec<Pose>, Failure> {
    let bytes = fs::read(path).map_err(|error| format!("{path}: {error}"))?;
    let numbers: Vec<f64> = bytes.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let pose = |&[tx, ty, tz, x, y, z, w]: &[f64; 7]| Ok(Pose::new([tx, ty, tz], [x, y, z, w])?);
    numbers.as_chunks().0.iter().map(pose).collect()
}
