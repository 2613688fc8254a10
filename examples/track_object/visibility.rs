use dymlm::core::{PinholeCamera, Pose};
use dymlm::geometry::convex_hull;
use dymlm::tracking::ObjectModel;
use dymlm_sim::SimulatedFrame;

/// Least share of the thing's outline that must show it for the thing to count as in view.
pub(crate) const IN_VIEW: f64 = 1.0 / 3.0;

/// True share of the carried thing's outline (the hull of its projected surface) in which the thing is
/// visible: the rest is occluded by hands or outside the image.
pub(crate) fn visible_share(frame: &SimulatedFrame, model: &ObjectModel) -> Option<f64> {
    let thing = frame.carried?;
    let camera_from_thing = frame.world_from_camera.inverse() * thing.world_from_object;
    let seen = frame.visible_things.iter().find(|visible| visible.id == thing.id);
    Some(
        seen.map_or(0.0, |seen| {
            seen.pixels as f64 / outline(frame.frame.camera(), &camera_from_thing, model)
        }),
    )
}

/// Area of the outline, square pixels.
fn outline(camera: &PinholeCamera, camera_from_thing: &Pose, model: &ObjectModel) -> f64 {
    let points = model.surface().iter();
    let pixels: Vec<[f64; 2]> = points
        .filter_map(|point| camera.project(camera_from_thing.transform_point(point.position)))
        .collect();
    let hull = convex_hull(&pixels);
    let next = hull.iter().cycle().skip(1);
    0.5 * hull.iter().zip(next).map(|(a, b)| a[0] * b[1] - a[1] * b[0]).sum::<f64>().abs()
}
