use dymlm_core::{BoundingBox, Frame, Pose};

use super::super::hiding::Hiding;
use super::super::recovery::Appearance;
use super::super::view::{Sight, View};
use super::ObjectTracker;
use super::fit::Fit;

/// How far outside of the model's bounds a reading may lie to belong to the object, metres.
pub(super) const MARGIN: f64 = 0.006;
/// Points that agree at least before what is seen becomes a view of its own.
const LEAST_FOR_VIEW: usize = 12;
/// Least share of a view's points that are found where, without depth, what is seen becomes a view of its own: else
/// something stands before the object.
const LEAST_SHOWN: f64 = 0.4;
/// Without depth a view is taken only of a pose known to these standard deviations, radians and metres.
const SURE: [f64; 2] = [0.03, 0.015];

/// What the object looks like.
impl ObjectTracker {
    /// Corrects the points of stored views by where they were seen.
    pub(super) fn correct_views(&mut self, frame: &Frame, fit: &Fit) {
        let Some(covariance) = &fit.covariance else { return };
        for sighting in &fit.sightings {
            if let Some(view) = self.views.get_mut(sighting.source[0]) {
                let pose = &fit.camera_from_object;
                view.correct(sighting, frame.camera(), pose, covariance, self.config.pixel_sigma);
            }
        }
    }

    /// Keeps the window on the object, and stores what it looks like from a new side.
    pub(super) fn learn(&mut self, frame: &Frame, fit: &Fit, bounding_box: Option<BoundingBox>) {
        if let Some(region) = bounding_box {
            // Refused when it has nearly left the image: then there is nothing to learn.
            if self.kcf.move_to(self.next.base(), region).is_ok() {
                self.kcf.learn(self.next.base());
            }
        }
        let pose = &fit.camera_from_object;
        let nearest = self.views.iter().map(|view| view.angle_to(pose)).fold(f64::INFINITY, f64::min);
        let is_sure =
            fit.sightings.len() >= LEAST_FOR_VIEW && fit.share > 0.6 && fit.surface.hidden_share() < 0.4;
        // Without depth nothing corrects a view's points later.
        let is_known = fit.surface.tells() || fit.is_known(SURE);
        let has_few =
            fit.sightings.len() < self.config.max_points / 4 && nearest > 0.4 * self.config.view_angle;
        if is_sure
            && is_known
            && self.views.len() < self.config.max_views
            && (nearest > self.config.view_angle || has_few)
        {
            let sight = Sight { camera: frame.camera(), pyramid: &self.next, depth: frame.depth() };
            // Where there is depth, that tells what stands before the object.
            let hiding = (!fit.surface.tells()).then(|| Hiding::of(&self.views, frame.camera(), fit));
            if hiding.as_ref().is_some_and(|hiding| hiding.share() < LEAST_SHOWN) {
                return;
            }
            let is_shown = |pixel| hiding.as_ref().is_none_or(|hiding| hiding.is_shown(pixel));
            let (margin, sigma) = (MARGIN, self.config.model_sigma);
            let view = View::take(sight, &self.model, pose, &mut self.corners, margin, sigma, is_shown);
            self.views.extend(view);
        }
    }

    /// The colours of the pixels in a region that are on the object.
    pub(super) fn appearance_in(
        &self,
        frame: &Frame,
        region: BoundingBox,
        camera_from_object: &Pose,
    ) -> Option<Appearance> {
        let object_from_camera = camera_from_object.inverse();
        let on_object = |u: usize, v: usize| {
            let reading = frame.depth().at(u, v);
            let place = frame.camera().back_project([u as f64, v as f64], reading.into());
            reading > 0.0 && self.model.contains(object_from_camera.transform_point(place), MARGIN)
        };
        let color = frame.color()?;
        Appearance::of(color, region, on_object).or_else(|| Appearance::of(color, region, |_, _| true))
    }
}
