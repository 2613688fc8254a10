use std::fs;
use std::path::Path;

use dymlm_core::{Distortion, PinholeCamera, Pose};
use serde::Deserialize;
use serde::de::DeserializeOwned;

use super::tum_camera::TumCamera;
use crate::Error;
use crate::image_file::check_size_of;

const CAMERA: &str = "camera.json";

/// The cameras of a dataset, and the scale of its depth images.
#[derive(Debug)]
pub(super) struct CameraFile {
    /// The camera of the colour images, and of the depth images unless `depth_camera` is there.
    pub(super) camera: PinholeCamera,
    pub(super) depth_scale: f64,
    pub(super) distortion: Option<Distortion>,
    pub(super) depth_camera: Option<DepthCamera>,
}

/// The camera of depth images that are not registered to the colour images.
#[derive(Debug)]
pub(super) struct DepthCamera {
    pub(super) camera: PinholeCamera,
    pub(super) color_from_depth: Pose,
    pub(super) distortion: Option<Distortion>,
}

/// The entries of `camera.json` other than the camera's own; unknown keys are ignored.
#[derive(Deserialize)]
struct BesideCamera {
    depth_scale: f64,
    distortion: Option<Distortion>,
    depth_camera: Option<serde_json::Value>,
}

/// The entries of `depth_camera` other than the camera's own.
#[derive(Deserialize)]
struct BesideDepthCamera {
    color_from_depth: Pose,
    distortion: Option<Distortion>,
}

/// The camera that the options name, or else the folder's `camera.json`, or else the camera in the folder's
/// name.
pub(super) fn read_camera(folder: &Path, named: Option<TumCamera>) -> Result<CameraFile, Error> {
    let path = folder.join(CAMERA);
    // The folder's own name says it, also where a link or `.` leads there.
    let in_name = || {
        let own = fs::canonicalize(folder).ok();
        TumCamera::named_in(folder).or_else(|| TumCamera::named_in(&own?))
    };
    let named = named.or_else(|| if path.exists() { None } else { in_name() });
    let Some(named) = named else { return read_file(&path) };
    let camera = named.camera().map_err(|error| Error::malformed(folder, error.to_string()))?;
    Ok(CameraFile { camera, depth_scale: TumCamera::DEPTH_SCALE, distortion: None, depth_camera: None })
}

fn read_file(path: &Path) -> Result<CameraFile, Error> {
    let bytes = fs::read(path).map_err(Error::io(path))?;
    // Parsed twice: with the camera flattened into one structure, errors would lose their line.
    let camera = parse(path, &bytes)?;
    let BesideCamera { depth_scale, distortion, depth_camera } = parse(path, &bytes)?;
    if !(depth_scale.is_finite() && depth_scale > 0.0) {
        let error = dymlm_core::Error::DepthScale(depth_scale);
        return Err(Error::malformed(path, error.to_string()));
    }
    let depth_camera = depth_camera.map(depth_camera_of).transpose();
    let depth_camera =
        depth_camera.map_err(|error| Error::malformed(path, format!("depth_camera: {error}")))?;
    for camera in [Some(&camera), depth_camera.as_ref().map(|depth| &depth.camera)].into_iter().flatten() {
        check_size_of(camera).map_err(|reason| Error::malformed(path, reason))?;
    }
    Ok(CameraFile { camera, depth_scale, distortion, depth_camera })
}

fn depth_camera_of(value: serde_json::Value) -> Result<DepthCamera, serde_json::Error> {
    let camera = PinholeCamera::deserialize(&value)?;
    let BesideDepthCamera { color_from_depth, distortion } = serde_json::from_value(value)?;
    Ok(DepthCamera { camera, color_from_depth, distortion })
}

fn parse<T: DeserializeOwned>(path: &Path, json: &[u8]) -> Result<T, Error> {
    serde_json::from_slice(json).map_err(|error| Error::line(path, error.line().max(1), error.to_string()))
}
