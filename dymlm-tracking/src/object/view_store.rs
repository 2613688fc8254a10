use dymlm_core::Pose;

use super::fit::Fit;
use super::model::ObjectModel;
use super::occlusion::PointOcclusion;
use super::pixel_lengths::PixelLengths;
use super::scene::Scene;
use super::view::{PointMatch, View};
use crate::flow::Template;
use crate::{CornerConfig, CornerDetector, Error};

/// Number of corners needed at the start.
pub(super) const LEAST_CORNERS: usize = 6;
/// Largest number of corners of a view.
const MOST_CORNERS: usize = 80;
/// Largest number of views, enough for all sides of an object about 15 degrees apart. Each holds a cut-out of
/// an image.
const MOST_VIEWS: usize = 48;
/// A view is added when its direction differs by this much from all stored ones, radians (15 degrees). Views
/// within this angle of each other show the same, and the older one has less error. A lower value lets errors
/// of views add up, a higher one leaves sides without points.
const VIEW_ANGLE: f64 = 0.26;
/// Without depth, views whose directions differ by less than this, radians, count as the same: their points
/// are only as accurate as the pose at which they were taken, so the oldest are the best. With a lower value
/// (15 degrees, as above) a bottle is off by 3.4 cm instead of 2.5 in every twentieth frame; a higher one
/// uses points on the far side.
const SAME_SIDE: f64 = 0.7;
/// Least number of agreeing points for a frame to become a view.
const LEAST_FOR_VIEW: usize = 12;
/// Number of points of a view, the strongest corners first, that are searched at each possible place of a
/// lost object.
const POINTS_SEARCHED: usize = 30;
/// The object's appearance from all sides seen so far.
#[derive(Debug, Clone)]
pub(super) struct ViewStore {
    views: Vec<View>,
    corners: CornerDetector,
    template: Template,
    lengths: PixelLengths,
    max_points: usize,
    model_sigma: f64,
}

impl ViewStore {
    /// Takes the first view of an object whose pose is known.
    pub(super) fn new(
        scene: Scene<'_>,
        model: &ObjectModel,
        camera_from_object: &Pose,
        max_points: usize,
        model_sigma: f64,
    ) -> Result<Self, Error> {
        let lengths = PixelLengths::of(scene.camera);
        let corners = CornerConfig { max_corners: MOST_CORNERS, min_distance: lengths.corner_distance };
        let mut corners = CornerDetector::new(&corners)?;
        let view =
            View::take(scene, model, camera_from_object, &mut corners, &lengths, model_sigma, |_| true);
        let found = view.as_ref().map_or(0, View::len);
        let Some(view) = view.filter(|_| found >= LEAST_CORNERS) else {
            return Err(Error::NotSeen { found, least: LEAST_CORNERS });
        };
        let (views, template) = (vec![view], Template::default());
        Ok(Self { views, corners, template, lengths, max_points, model_sigma })
    }

    /// Number of views.
    pub(super) fn len(&self) -> usize {
        self.views.len()
    }

    /// Finds points near a pose, those of the views with the nearest direction first.
    pub(super) fn find_points(&mut self, scene: Scene<'_>, pose: &Pose) -> Vec<PointMatch> {
        let mut matches: Vec<PointMatch> = Vec::with_capacity(self.max_points);
        let mut tried = 0;
        let step = if scene.has_depth_at(pose.translation()) { VIEW_ANGLE } else { SAME_SIDE };
        for index in self.by_angle(pose, step) {
            let Some(view) = self.views.get(index) else { continue };
            for (i, position) in view.positions().enumerate() {
                if tried >= 2 * self.max_points || matches.len() >= self.max_points {
                    return matches;
                }
                if scene.is_occluded(pose.transform_point(position), self.model_sigma) {
                    continue;
                }
                tried += 1;
                let found = view.find([index, i], scene, pose, &mut self.template, &self.lengths, 0);
                // A corner that two views contain counts only once.
                let is_new = |found: &PointMatch| {
                    let apart = |other: &PointMatch| {
                        [0, 1]
                            .map(|i| (other.pixel[i] - found.pixel[i]).abs())
                            .into_iter()
                            .fold(0.0, f32::max)
                    };
                    matches.iter().all(|other| apart(other) > self.lengths.point_distance)
                };
                matches.extend(found.filter(is_new));
            }
        }
        matches
    }

    /// Finds points of the view whose direction is nearest to `side`, near a pose, in an image halved
    /// `halvings` times, which extends the reach of the search.
    pub(super) fn find_coarsely(
        &mut self,
        scene: Scene<'_>,
        side: &Pose,
        pose: &Pose,
        halvings: usize,
    ) -> Vec<PointMatch> {
        let nearest = self.by_angle(side, VIEW_ANGLE).first().copied();
        let Some((index, view)) = nearest.and_then(|index| Some((index, self.views.get(index)?))) else {
            return Vec::new();
        };
        (0..view.len().min(POINTS_SEARCHED))
            .filter_map(|i| view.find([index, i], scene, pose, &mut self.template, &self.lengths, halvings))
            .collect()
    }

    /// The poses of the views, that with the nearest direction first.
    pub(super) fn poses(&self, pose: &Pose) -> impl Iterator<Item = Pose> {
        let order = self.by_angle(pose, VIEW_ANGLE);
        order.into_iter().filter_map(|index| Some(self.views.get(index)?.camera_from_object))
    }

    /// Points of all views that face the camera at a pose, in the camera's frame.
    pub(super) fn facing<'a>(
        &'a self,
        scene: Scene<'a>,
        pose: &'a Pose,
    ) -> impl Iterator<Item = [f64; 3]> + 'a {
        self.views.iter().flat_map(move |view| view.facing(scene, pose))
    }

    /// Corrects the points by the pixels where they were found ([`View::correct`]).
    pub(super) fn correct(&mut self, scene: Scene<'_>, fit: &Fit, repeated: f64) {
        let Some(covariance) = &fit.covariance else { return };
        for found in &fit.matches {
            if let Some(view) = self.views.get_mut(found.source[0]) {
                view.correct(found, scene, &fit.camera_from_object, covariance, repeated);
            }
        }
    }

    /// Stores a view of a new side of the object, if enough points agree with the pose.
    pub(super) fn learn(&mut self, scene: Scene<'_>, model: &ObjectModel, fit: &Fit) {
        let pose = &fit.camera_from_object;
        let nearest = self.views.iter().map(|view| view.angle_to(pose)).fold(f64::INFINITY, f64::min);
        let is_sure = fit.matches.len() >= LEAST_FOR_VIEW;
        let has_few = fit.matches.len() < self.max_points / 4 && nearest > 0.4 * VIEW_ANGLE;
        if !is_sure || self.views.len() >= MOST_VIEWS || !(nearest > VIEW_ANGLE || has_few) {
            return;
        }
        // With depth, readings tell what is occluded and correct the points; without, the points found do.
        let near = 1.5 * self.lengths.point_distance;
        let occlusion =
            (!fit.surface.has_enough()).then(|| PointOcclusion::of(&self.views, scene, fit, near));
        let is_shown = |pixel| occlusion.as_ref().is_none_or(|occlusion| occlusion.is_shown(pixel));
        let (corners, lengths, sigma) = (&mut self.corners, &self.lengths, self.model_sigma);
        self.views.extend(View::take(scene, model, pose, corners, lengths, sigma, is_shown));
    }

    /// Indices of the views, the nearest directions first, in steps of `step` radians; within a step the
    /// oldest first.
    fn by_angle(&self, pose: &Pose, step: f64) -> Vec<usize> {
        let mut order: Vec<(f64, usize)> = self
            .views
            .iter()
            .enumerate()
            .map(|(i, view)| ((view.angle_to(pose) / step).floor(), i))
            .collect();
        order.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        order.into_iter().map(|(_, i)| i).collect()
    }
}
