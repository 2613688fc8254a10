use dymlm_core::PinholeCamera;

use super::tracker::Fit;
use super::view::View;

/// Tells where an image shows the object by the points of views that were found there and those that were not.
pub(super) struct Hiding {
    found: Vec<[f64; 2]>,
    missed: Vec<[f64; 2]>,
}

impl Hiding {
    pub(super) fn of(views: &[View], camera: &PinholeCamera, fit: &Fit) -> Self {
        let found: Vec<[f64; 2]> =
            fit.sightings.iter().map(|sighting| sighting.pixel.map(f64::from)).collect();
        let is_found = |pixel: &[f64; 2]| found.iter().any(|&other| squared_distance(*pixel, other) <= 9.0);
        let used = |index: &usize| fit.sightings.iter().any(|sighting| sighting.source[0] == *index);
        let missed = (0..views.len())
            .filter(used)
            .flat_map(|index| views[index].facing(camera, &fit.camera_from_object))
            .filter_map(|place| camera.project(place).filter(|&pixel| camera.sees(pixel)))
            .filter(|pixel| !is_found(pixel))
            .collect();
        Self { found, missed }
    }

    /// Share of the points that were found.
    pub(super) fn share(&self) -> f64 {
        self.found.len() as f64 / (self.found.len() + self.missed.len()).max(1) as f64
    }

    /// Whether the points nearest to a pixel were found.
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
