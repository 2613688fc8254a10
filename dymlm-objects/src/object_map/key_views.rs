use dymlm_core::{BoundingBox, PinholeCamera, Pose};

use super::FULL;
use crate::association::visible_iou;
use crate::optimization::MAX_IOU_LOSS;
use crate::{Completeness, ObjectShape, SideView};

/// The camera, pose and box of one detection of an object.
#[derive(Debug, Clone, Copy)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct KeyView {
    pub(crate) camera: PinholeCamera,
    pub(crate) world_from_camera: Pose,
    pub(crate) bounding_box: BoundingBox,
    pub(crate) completeness: Completeness,
}

impl KeyView {
    /// Intersection over union of a shape's projection with the detector's box.
    pub(crate) fn projection_iou(&self, shape: &ObjectShape) -> f64 {
        let projected = shape.image_box(&self.camera, &self.world_from_camera);
        projected.map_or(0.0, |projected| {
            visible_iou(&projected, &self.bounding_box, self.completeness, &self.camera)
        })
    }

    /// Whether a place of the world is beyond a side of the detector's box that is an end of the thing, by
    /// more than a share of the box; `None` when it is not before the camera.
    fn excludes(&self, camera_from_world: Pose, place: [f64; 3], margin: f64) -> Option<bool> {
        let [u, v] = self.camera.project(camera_from_world.transform_point(place))?;
        let own = &self.bounding_box;
        let [x, y] = [own.width(), own.height()].map(|side| margin * f64::from(side));
        let [left, top, right, bottom] = self.completeness.sides().map(|side| side == SideView::Whole);
        let is_beyond = (left && u < f64::from(own.x_min()) - x)
            || (top && v < f64::from(own.y_min()) - y)
            || (right && u > f64::from(own.x_max()) + x)
            || (bottom && v > f64::from(own.y_max()) + y);
        Some(is_beyond)
    }

    /// Whether it fits one shape clearly better than another.
    fn prefers(&self, one: &ObjectShape, other: &ObjectShape) -> bool {
        self.projection_iou(one) > self.projection_iou(other) + MAX_IOU_LOSS
    }

    /// Share of a shape's projection that is in the detector's box, 0..=1. What lies beyond the image's
    /// border is not shown.
    fn shown_share(&self, shape: &ObjectShape) -> f64 {
        let projected = shape.image_box(&self.camera, &self.world_from_camera);
        projected.map_or(0.0, |projected| projected.share_in(&self.bounding_box))
    }
}

/// A bounded selection of an object's views, spread evenly over the summed weight of its observations: when
/// there are too many, every second view is dropped, and from then on only every second one is added.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct KeyViews {
    views: Vec<KeyView>,
    stride_log2: u32,
    /// Sum of the weights.
    seen: u64,
    /// The view of the last observation, whether it is among them or not.
    newest: Option<KeyView>,
}

/// Most views kept for an object; new parameters are judged by them.
const MAX_KEY_VIEWS: usize = 12;
/// How far beyond a side of a detector's box a place must be to be none of the thing, as a share of the box.
/// A lower value cuts things by the detector's jitter, a higher one leaves them what stands beside them.
const BEYOND: f64 = 0.05;

impl KeyViews {
    /// Whether its numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        self.views.len() <= MAX_KEY_VIEWS && self.stride_log2 < 64 && self.seen < 1 << 62
    }

    /// Adds the view of an observation.
    pub(crate) fn add(&mut self, view: KeyView, weight: u32) {
        self.newest = Some(view);
        self.choose(view, weight);
    }

    fn choose(&mut self, view: KeyView, weight: u32) {
        let stride = u64::from(FULL) << self.stride_log2.min(32);
        let before = self.seen;
        self.seen = before.saturating_add(weight.into());
        if before == 0 || before / stride != self.seen / stride {
            self.views.push(view);
        }
        if self.views.len() > MAX_KEY_VIEWS {
            let mut index = 0;
            self.views.retain(|_| {
                index += 1;
                index % 2 == 1
            });
            self.stride_log2 += 1;
        }
    }

    /// Moves the views with their object, as if they had been taken of it at its new place.
    pub(crate) fn move_by(&mut self, new_from_old: &Pose) {
        for view in self.views.iter_mut().chain(&mut self.newest) {
            view.world_from_camera = *new_from_old * view.world_from_camera;
        }
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = &KeyView> {
        self.views.iter()
    }

    /// Bytes that the views own.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.views.capacity() * size_of::<KeyView>()
    }

    /// Adds the views of a merged object, which `is_later` if it was observed last.
    pub(crate) fn merge(&mut self, other: &Self, is_later: bool) {
        other.views.iter().for_each(|view| self.choose(*view, FULL));
        if is_later {
            self.newest = other.newest;
        }
    }

    /// The view of the last observation.
    pub(crate) fn newest(&self) -> Option<&KeyView> {
        self.newest.as_ref()
    }

    /// Whether the last observation fits a new shape clearly better than the old one: then the thing stands
    /// there now.
    pub(crate) fn have_moved_on(&self, old: &ObjectShape, new: &ObjectShape) -> bool {
        self.newest.is_some_and(|view| view.prefers(new, old))
    }

    /// Whether the last observation excludes that a place is the thing's: it lies beyond an end of its outline.
    pub(crate) fn newest_excludes(&self) -> impl Fn([f64; 3]) -> bool + use<> {
        let view = self.newest.map(|view| (view, view.world_from_camera.inverse()));
        move |place| view.is_some_and(|(view, inverse)| view.excludes(inverse, place, 0.0) == Some(true))
    }

    /// Whether most of the views exclude that a place is the thing's: the box of a bottle from the one side
    /// holds the cup behind it, from others it does not.
    pub(crate) fn most_exclude(&self) -> impl Fn([f64; 3]) -> bool + use<> {
        let views: Vec<_> = self.views.iter().map(|view| (*view, view.world_from_camera.inverse())).collect();
        move |place| {
            let answers = views.iter().filter_map(|(view, inverse)| view.excludes(*inverse, place, BEYOND));
            let (excluded, all) =
                answers.fold((0, 0), |(excluded, all), own| (excluded + u32::from(own), all + 1));
            2 * excluded > all
        }
    }

    /// Drops the views that fit the new shape of a thing that has moved clearly worse than the old one: they
    /// are of where it stood before. Returns whether there were any.
    pub(crate) fn drop_outdated(&mut self, old: &ObjectShape, new: &ObjectShape) -> bool {
        let before = self.views.len();
        self.views.retain(|view| !view.prefers(old, new));
        let dropped = self.views.len() < before;
        if dropped {
            // Those that come next are as welcome as the first ones were.
            (self.stride_log2, self.seen) = (0, 0);
        }
        if self.views.is_empty() {
            self.views.extend(self.newest);
        }
        dropped
    }

    /// Mean intersection over union of a shape's projections with the views' boxes; `None` without views.
    pub(crate) fn mean_iou(&self, shape: &ObjectShape) -> Option<f64> {
        self.mean(|view| view.projection_iou(shape))
    }

    /// [`Self::mean_iou`] without allowance for projections that reach beyond a cut side of a detection.
    pub(crate) fn mean_whole_iou(&self, shape: &ObjectShape) -> Option<f64> {
        let whole = |view: &KeyView| KeyView { completeness: Completeness::default(), ..*view };
        self.mean(|view| whole(view).projection_iou(shape))
    }

    /// Whether any view shows at least a share of a shape's projection, 0..=1.
    pub(crate) fn show(&self, shape: &ObjectShape, share: f64) -> bool {
        self.views.iter().any(|view| view.shown_share(shape) >= share)
    }

    fn mean(&self, iou: impl Fn(&KeyView) -> f64) -> Option<f64> {
        let sum: f64 = self.views.iter().map(iou).sum();
        (!self.views.is_empty()).then(|| sum / self.views.len() as f64)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A view along z from the origin whose detection is around u = 100 to 200, v = 100 to 200.
    fn view(completeness: Completeness) -> KeyView {
        KeyView {
            camera: PinholeCamera::new(640, 480, 500.0, 500.0, 150.0, 150.0).unwrap(),
            world_from_camera: Pose::identity(),
            bounding_box: BoundingBox::new(100.0, 100.0, 200.0, 200.0).unwrap(),
            completeness,
        }
    }

    fn views(all: impl IntoIterator<Item = KeyView>) -> KeyViews {
        let mut views = KeyViews::default();
        all.into_iter().for_each(|view| views.add(view, FULL));
        views
    }

    #[test]
    fn what_most_boxes_do_not_hold_is_none_of_the_thing() {
        let whole = view(Completeness::default());
        let elsewhere =
            KeyView { world_from_camera: Pose::new([0.1, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap(), ..whole };
        // At a depth of 1 m, the box reaches 10 cm to each side; the second camera is 10 cm to the right.
        let excludes = views([whole, elsewhere, elsewhere]).most_exclude();
        assert!(excludes([-0.08, 0.0, 1.0]) && excludes([0.25, 0.0, 1.0]));
        assert!(!excludes([0.08, 0.0, 1.0]) && !excludes([0.18, 0.0, 1.0]));
        let excludes = views([whole, whole, elsewhere]).most_exclude();
        assert!(!excludes([-0.08, 0.0, 1.0]) && excludes([0.18, 0.0, 1.0]));
        // The detector's jitter.
        assert!(!excludes([-0.108, 0.0, 1.0]) && excludes([-0.112, 0.0, 1.0]));
    }

    #[test]
    fn views_exclude_nothing_beyond_a_side_that_something_hides_or_behind_the_camera() {
        let hidden = Completeness { left: SideView::Occluder, ..Completeness::default() };
        let excludes = views([view(hidden)]).most_exclude();
        assert!(!excludes([-0.3, 0.0, 1.0]) && excludes([0.3, 0.0, 1.0]));
        assert!(!excludes([0.3, 0.0, -1.0]));
        assert!(!KeyViews::default().most_exclude()([0.0, 0.0, 1.0]));
    }
}
