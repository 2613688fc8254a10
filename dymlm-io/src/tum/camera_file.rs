use std::fs;
use std::path::Path;

use dymlm_core::PinholeCamera;

use crate::Error;

/// What `camera.json` holds; other keys are passed over.
#[derive(serde::Deserialize)]
struct RawCamera {
    width: usize,
    height: usize,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    depth_scale: f64,
}

/// Reads the camera and the stored depth units in a metre.
pub(super) fn read_camera(path: &Path) -> Result<(PinholeCamera, f64), Error> {
    let bytes = fs::read(path).map_err(Error::io(path))?;
    let raw: RawCamera = serde_json::from_slice(&bytes)
        .map_err(|error| Error::line(path, error.line().max(1), error.to_string()))?;
    let camera = PinholeCamera::new(raw.width, raw.height, raw.fx, raw.fy, raw.cx, raw.cy)
        .map_err(|error| Error::malformed(path, error.to_string()))?;
    if !(raw.depth_scale.is_finite() && raw.depth_scale > 0.0) {
        let error = dymlm_core::Error::DepthScale(raw.depth_scale);
        return Err(Error::malformed(path, error.to_string()));
    }
    Ok((camera, raw.depth_scale))
}
