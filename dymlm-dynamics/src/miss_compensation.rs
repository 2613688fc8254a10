use dymlm_core::{PinholeCamera, SensorModel, Visibility};

use crate::{BoxSource, Foreground, Mover};

/// How far the median depth of a person's surface changes when the box cuts it differently, three standard
/// deviations, metres. A lower value loses people who turn, a higher one takes what they walk past for them
/// (test `nobody_is_nobody`).
pub(crate) const DEPTH_CHANGE: f64 = 0.2;
/// Walking speed of movers indoors, metres per second: the tolerance grows at this speed from the time when a
/// track was last seen. A lower value loses people who walk towards the camera.
const MOVER_SPEED: f64 = 0.7;

/// How far a mover may have gone in the image since its last detection, pixels; `None` when it never had one,
/// or its distance is not known.
pub(crate) fn gone_since_detected(mover: &Mover, camera: &PinholeCamera) -> Option<f32> {
    match mover.source {
        BoxSource::Detected { .. } => Some(0.0),
        BoxSource::Predicted { missed_for } => {
            let metres = MOVER_SPEED * missed_for;
            mover.depth.map(|depth| (camera.fx().abs() * metres) as f32 / depth)
        }
        BoxSource::FreeSpace => None,
    }
}

/// Decides whether a track without a detection is still where its motion puts it: paper section III-A,
/// "missed detection compensation".
///
/// The predicted box must hold a foreground at about the depth of the track. A track whose depth was never
/// known, or whose box holds no depth, is not kept. `missed_for` is the time since the last detection,
/// seconds.
pub(crate) fn is_still_there(
    foreground: &Foreground,
    expected_depth: Option<f32>,
    missed_for: f64,
    sensor: &SensorModel,
) -> bool {
    let (Some(found), Some(expected)) = (foreground.depth(), expected_depth) else { return false };
    let place_sigma = (DEPTH_CHANGE + MOVER_SPEED * missed_for) / 3.0;
    let tolerance = sensor.tolerance(expected, place_sigma);
    Visibility::of_reading(found.into(), expected.into(), tolerance) == Visibility::Present
}
