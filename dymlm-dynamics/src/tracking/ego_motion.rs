use super::{BoxKalman, View};

/// Re-projects a track from the image in which it was last predicted to the next one, as if it stood still in
/// the world: its centre moves, and its lengths grow as the camera comes nearer. Returns its depth in the new
/// camera, and the factor of its lengths.
///
/// Without a depth only the camera's rotation can be undone. A box that would end up behind the camera, or
/// whose size would change by more than a factor of 4, stays as it was.
pub(super) fn compensate(
    filter: &mut BoxKalman,
    depth: Option<f32>,
    before: &View,
    now: &View,
) -> (Option<f32>, f64) {
    let camera_from_before = now.world_from_camera.inverse() * before.world_from_camera;
    let z_before = depth.map_or(1.0, f64::from);
    let point = before.camera.back_project(filter.center(), z_before);
    let moved = if depth.is_some() {
        camera_from_before.transform_point(point)
    } else {
        camera_from_before.rotate(point)
    };

    let scale = z_before / moved[2] * (now.camera.fx() / before.camera.fx()).abs();
    match now.camera.project(moved) {
        Some(center) if (0.25..=4.0).contains(&scale) => {
            filter.reproject(center, scale);
            (depth.map(|_| moved[2] as f32), scale)
        }
        _ => (depth, 1.0),
    }
}
