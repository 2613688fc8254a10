use dymlm_core::vector3::{cross, norm};
use dymlm_core::{BoundingBox, Detection, Frame, PinholeCamera, Pose};
use nalgebra::Vector6;

use super::super::recovery::{Place, Wanted};
use super::super::view::{Likeness, Sight, Sighting, projected_bounds};
use super::ObjectTracker;
use super::fit::{Fit, SAME_DIRECTION, views_by_angle};
use crate::pose::moved;

/// Points of a view, the strongest corners first, that are searched at a place at which a lost object may be.
const POINTS_SEARCHED: usize = 30;
/// Images are halved so often for a search: by 2, it reaches as far as four times 7 pixels.
const HALVINGS_SEARCHED: usize = 2;
/// Least correlation of windows in halved images.
const COARSE_CORRELATION: f32 = 0.6;
/// Attitudes tried in a frame beside the last, the views among them, and the turn of the others, radians.
const ATTITUDES_A_FRAME: usize = 2;
const MOST_VIEWS_SEARCHED: usize = 8;
const TURNED: f64 = 0.5;

/// Finding an object again.
impl ObjectTracker {
    /// Looks for an object that its last points did not lead to.
    pub(super) fn search(
        &mut self,
        frame: &Frame,
        detections: &[Detection],
        predicted: &Pose,
        window_center: Option<[f32; 2]>,
    ) -> Option<Fit> {
        self.searches += 1;
        let camera = frame.camera();
        let color = frame.color()?;
        let last_box = projected_bounds(&self.model, camera, predicted);
        let window = window_center.map(|_| self.kcf.bounding_box());
        let others: Vec<BoundingBox> = window.into_iter().chain(last_box).collect();
        let wanted = Wanted {
            model: &self.model,
            label: self.label.as_deref(),
            appearance: self.appearance.as_ref(),
            camera_from_object: *predicted,
        };
        let places = wanted.places(camera, color, frame.depth(), detections, &others);
        let attitudes = self.attitudes(predicted);
        // The last one in each frame, the others in turn.
        let others = attitudes.len().saturating_sub(1).max(1);
        let turn = |i: usize| 1 + (ATTITUDES_A_FRAME * self.searches + i) % others;
        let chosen: Vec<Pose> = std::iter::once(0)
            .chain((0..ATTITUDES_A_FRAME).map(turn))
            .filter_map(|i| attitudes.get(i).copied())
            .collect();
        for place in places {
            for attitude in &chosen {
                if let Some(start) = placed(camera, attitude, place)
                    && let Some(coarse) = self.pose_near(frame, &start)
                    && let Some(fit) = self.fit(frame, &coarse, None)
                    && fit.sightings.len() >= 2 * self.config.min_inliers
                {
                    return Some(fit);
                }
            }
        }
        None
    }

    /// How a lost object may be turned, as poses at any place: as it was last, as the stored views show it, the nearest
    /// first, and as it was turned by some more.
    fn attitudes(&self, predicted: &Pose) -> Vec<Pose> {
        let order = views_by_angle(&self.views, predicted, SAME_DIRECTION[0]);
        let seen = order.iter().filter_map(|&i| self.views.get(i)).map(|view| view.camera_from_object);
        let turned = [0, 1, 2].into_iter().flat_map(|axis| {
            [-TURNED, TURNED].map(|angle| {
                let mut turn = Vector6::zeros();
                turn[axis] = angle;
                moved(predicted, &turn)
            })
        });
        std::iter::once(*predicted).chain(seen.take(MOST_VIEWS_SEARCHED)).chain(turned).collect()
    }

    /// The pose about a rough one at which the image shows points of the view that is nearest to it.
    fn pose_near(&mut self, frame: &Frame, start: &Pose) -> Option<Pose> {
        let index = *views_by_angle(&self.views, start, SAME_DIRECTION[0]).first()?;
        let view = self.views.get(index)?;
        let count = view.points.len().min(POINTS_SEARCHED);
        let mut found = None;
        // Coarse levels may tell nothing: they only prepare.
        for halvings in (0..=HALVINGS_SEARCHED).rev() {
            let min_correlation =
                if halvings == 0 { self.config.min_correlation } else { COARSE_CORRELATION };
            let like = Likeness { halvings, min_correlation, ..self.config.likeness() };
            let sight = Sight { camera: frame.camera(), pyramid: &self.next, depth: frame.depth() };
            let (pose, template) = (found.unwrap_or(*start), &mut self.template);
            let sightings: Vec<Sighting> =
                (0..count).filter_map(|i| view.sight([index, i], sight, &pose, template, like)).collect();
            found = self.agree(frame, &sightings, None).or(found.filter(|_| halvings > 0));
        }
        found
    }
}

/// A pose turned with the ray so that the object's origin appears at a place, showing the same side.
pub(super) fn placed(camera: &PinholeCamera, pose: &Pose, place: Place) -> Option<Pose> {
    let center = place.center.map(f64::from);
    let origin = camera.back_project(center, place.depth);
    let bearing = |p: [f64; 3]| {
        let distance = norm(p);
        p.map(|x| x / distance)
    };
    // The shortest turn from the old ray to the new one.
    let axis = cross(bearing(pose.translation()), bearing(origin));
    let sine = norm(axis);
    let angle = sine.clamp(0.0, 1.0).asin();
    let turn =
        crate::pose::rotation_about(if sine > 1e-12 { axis.map(|x| x / sine * angle) } else { [0.0; 3] });
    Pose::new(origin, (turn * *pose).quaternion()).ok()
}
