use super::{BoxKalman, View};

/// Factors by which the size of a box may change from one image to the next, the least and the greatest: what
/// comes beside the camera would otherwise grow without end.
const SCALES: [f64; 2] = [0.25, 4.0];

/// What the camera's own motion has made of a track.
pub(super) struct Reprojection {
    /// Depth in the new camera.
    pub(super) depth: Option<f32>,
    /// Factor of lengths in the image.
    pub(super) scale: f64,
    /// How far the image has turned, radians.
    pub(super) roll: f64,
}

/// Re-projects a track from the image in which it was last predicted to the next one, as if it stood still in
/// the world: its centre moves, and its lengths grow as the camera comes nearer. Without a depth only the
/// camera's rotation can be undone. `None` where its centre comes to lie behind the camera.
pub(super) fn compensate(
    filter: &mut BoxKalman,
    depth: Option<f32>,
    before: &View,
    now: &View,
) -> Option<Reprojection> {
    let camera_from_before = now.world_from_camera.inverse() * before.world_from_camera;
    let z_before = depth.map_or(1.0, f64::from);
    let point = before.camera.back_project(filter.center(), z_before);
    let moved = if depth.is_some() {
        camera_from_before.transform_point(point)
    } else {
        camera_from_before.rotate(point)
    };

    let center = now.camera.project(moved)?;
    let [least, greatest] = SCALES;
    let scale = (z_before / moved[2] * (now.camera.fx() / before.camera.fx()).abs()).clamp(least, greatest);
    filter.reproject(center, scale);
    // Where what was to the right is now; a camera whose axis is flipped turns the image the other way.
    let [x, y, _] = camera_from_before.rotate([before.camera.fx().signum(), 0.0, 0.0]);
    let roll = (y * now.camera.fy().signum()).atan2(x * now.camera.fx().signum());
    Some(Reprojection { depth: depth.map(|_| moved[2] as f32), scale, roll })
}
