use dymlm_core::{BoundingBox, PinholeCamera, Pose};

use super::FULL;
use crate::association::visible_iou;
use crate::{Completeness, ObjectShape};

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
}

/// Most views kept for an object; new parameters are judged by them.
const MAX_KEY_VIEWS: usize = 12;

impl KeyViews {
    /// Whether its numbers are plausible; a damaged file may hold others.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        self.views.len() <= MAX_KEY_VIEWS && self.stride_log2 < 64 && self.seen < 1 << 62
    }

    pub(crate) fn add(&mut self, view: KeyView, weight: u32) {
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
        for view in &mut self.views {
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

    /// Adds the views of a merged object.
    pub(crate) fn merge(&mut self, other: &Self) {
        other.views.iter().for_each(|view| self.add(*view, FULL));
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
