use dymlm_core::{Frame, Pose};

/// The reading at a pixel, if there is one.
pub(super) fn reading_at(frame: &Frame, pixel: [f32; 2]) -> Option<f64> {
    let [u, v] = pixel.map(f32::round);
    if u < 0.0 || v < 0.0 {
        return None;
    }
    let reading = frame.depth().at(u as usize, v as usize);
    (reading > 0.0).then(|| reading.into())
}

/// A reading at the object's origin.
pub(super) fn reading_near(frame: &Frame, pose: &Pose) -> Option<f64> {
    let pixel = frame.camera().project(pose.translation())?;
    reading_at(frame, pixel.map(|c| c as f32))
}

/// Whether something stands before a point at a pose.
pub(super) fn is_hidden(frame: &Frame, pose: &Pose, position: [f64; 3], gate: f64) -> bool {
    let place = pose.transform_point(position);
    let Some(pixel) = frame.camera().project(place) else { return true };
    reading_at(frame, pixel.map(|c| c as f32)).is_some_and(|reading| place[2] - reading > 1.5 * gate)
}
