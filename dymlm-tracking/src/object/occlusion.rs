use super::fit::Fit;
use super::scene::Scene;
use super::view::View;

/// Tells without depth where something occludes the object: by the points of stored views that were found and
/// those that were not.
pub(super) struct PointOcclusion {
    found: Vec<[f64; 2]>,
    missed: Vec<[f64; 2]>,
}

impl PointOcclusion {
    /// `near`: distance within which two points of the image count as one, pixels.
    pub(super) fn of(views: &[View], scene: Scene<'_>, fit: &Fit, near: f32) -> Self {
        let camera = scene.camera;
        let near = f64::from(near).powi(2);
        let found: Vec<[f64; 2]> = fit.matches.iter().map(|found| found.pixel.map(f64::from)).collect();
        let is_found = |pixel: &[f64; 2]| found.iter().any(|&other| squared_distance(*pixel, other) <= near);
        let is_used = |index: &usize| fit.matches.iter().any(|found| found.source[0] == *index);
        let missed = (0..views.len())
            .filter(is_used)
            .flat_map(|index| views[index].facing(scene, &fit.camera_from_object))
            .filter_map(|place| camera.project(place).filter(|&pixel| camera.sees(pixel)))
            .filter(|pixel| !is_found(pixel))
            .collect();
        Self { found, missed }
    }

    /// Whether the point nearest to a pixel was found.
    pub(super) fn is_shown(&self, pixel: [f64; 2]) -> bool {
        let nearest = |points: &[[f64; 2]]| {
            points.iter().map(|&other| squared_distance(pixel, other)).fold(f64::INFINITY, f64::min)
        };
        nearest(&self.found) <= nearest(&self.missed)
    }
}

fn squared_distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2)
}
