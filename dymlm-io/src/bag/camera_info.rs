use dymlm_core::{Distortion, PinholeCamera};

use crate::image_file::check_size_of;
use crate::ros2::messages::Lens;

/// The camera that a `CameraInfo` describes.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct InfoCamera {
    pub(super) camera: PinholeCamera,
    pub(super) distortion: Option<Distortion>,
}

/// The camera of a `CameraInfo`. For images that ROS has rectified, it is the projection matrix P without
/// distortion; for others, it is K with the distortion.
pub(super) fn camera_of(lens: &Lens, is_rectified: bool) -> Result<InfoCamera, String> {
    let whole = |binning: u32| binning <= 1;
    let roi = &lens.roi;
    let is_part = roi.x_offset != 0
        || roi.y_offset != 0
        || ![0, lens.width].contains(&roi.width)
        || ![0, lens.height].contains(&roi.height);
    if !whole(lens.binning_x) || !whole(lens.binning_y) || is_part {
        return Err("binning and regions of interest are not read".to_owned());
    }
    let [fx, _, cx, _, fy, cy, ..] = lens.k;
    let [pfx, _, pcx, _, _, pfy, pcy, ..] = lens.p;
    // Some drivers of depth cameras leave P empty: then K is used.
    let use_p = is_rectified && pfx > 0.0;
    let [fx, fy, cx, cy] = if use_p { [pfx, pfy, pcx, pcy] } else { [fx, fy, cx, cy] };
    let camera = PinholeCamera::new(lens.width as usize, lens.height as usize, fx, fy, cx, cy)
        .map_err(|error| error.to_string())?;
    check_size_of(&camera)?;
    let distortion =
        if is_rectified || lens.d.iter().all(|&d| d == 0.0) { None } else { Some(distortion_of(lens)?) };
    Ok(InfoCamera { camera, distortion })
}

fn distortion_of(lens: &Lens) -> Result<Distortion, String> {
    let lens_model = lens.distortion_model.as_str();
    match lens_model {
        "plumb_bob" | "rational_polynomial" => Distortion::brown_conrady(&lens.d),
        "equidistant" | "fisheye" => {
            let [a, b, c, d] = *lens.d.as_slice() else {
                return Err(format!("{} coefficients of {lens_model} instead of 4", lens.d.len()));
            };
            Distortion::equidistant([a, b, c, d])
        }
        other => {
            return Err(format!(
                "distortion {other:?}; plumb_bob, rational_polynomial and equidistant are read"
            ));
        }
    }
    .map_err(|error| error.to_string())
}
