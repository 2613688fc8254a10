use std::fs;
use std::path::Path;

use dymlm_core::PinholeCamera;
use serde::de::DeserializeOwned;

use crate::Error;

/// What `camera.json` holds beside the camera; other keys are passed over.
#[derive(serde::Deserialize)]
struct DepthUnits {
    depth_scale: f64,
}

/// Reads the camera and the stored depth units in a metre.
pub(super) fn read_camera(path: &Path) -> Result<(PinholeCamera, f64), Error> {
    let bytes = fs::read(path).map_err(Error::io(path))?;
    // Read twice: in one structure with the camera flattened into it, errors would lose their line.
    let camera = parse(path, &bytes)?;
    let DepthUnits { depth_scale } = parse(path, &bytes)?;
    if !(depth_scale.is_finite() && depth_scale > 0.0) {
        let error = dymlm_core::Error::DepthScale(depth_scale);
        return Err(Error::malformed(path, error.to_string()));
    }
    Ok((camera, depth_scale))
}

fn parse<T: DeserializeOwned>(path: &Path, json: &[u8]) -> Result<T, Error> {
    serde_json::from_slice(json).map_err(|error| Error::line(path, error.line().max(1), error.to_string()))
}
