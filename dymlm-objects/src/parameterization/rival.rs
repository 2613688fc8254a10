use dymlm_core::vector3::bounds;
use dymlm_core::{BoundingBox, Detection};
use dymlm_geometry::BoxCluster;

use crate::{MapObject, ObjectView};

/// Another thing in the image that a cluster in a detection's box may show: what another detection means, or
/// a confirmed object of the map.
///
/// The box of a chair behind a table holds the laptop and the bottles on the table. They are nearer, and
/// often fill more of the box than the back of the chair does.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Rival<'a> {
    pub(crate) label: &'a str,
    /// Where it appears, pixels.
    pub(crate) bounding_box: BoundingBox,
    /// Least and greatest depth at which it may be read, metres; `None` where only the detector knows of it.
    pub(crate) depths: Option<[f32; 2]>,
}

/// Greatest share of a detection's box that a rival covers. One that covers more may be the same thing,
/// detected twice or mapped with another label. A lower value lets large things on a table be taken for what
/// is behind it, a higher one leaves nothing in the box of a thing that was detected twice.
const MOST_COVERED: f64 = 0.5;
/// Least intersection over union of a cluster's bounds with a rival's part of the box for the cluster to show
/// it. A lower value takes the arm of a chair for the chair beside it, a higher one leaves what something
/// else cuts off.
const FITS: f64 = 0.5;
/// How many times as well as the detection's own box the rival's part of it must fit. At 1 the detector's
/// jitter decides between two detections of one thing.
const CLEARLY: f64 = 1.5;

impl<'a> Rival<'a> {
    /// What a detection means.
    pub(super) fn detected(detection: &'a Detection) -> Self {
        Self { label: detection.label(), bounding_box: detection.bounding_box(), depths: None }
    }

    /// An object where a frame shows it, occluded or not; `None` when it is not before the camera.
    pub(crate) fn mapped(object: &'a MapObject, view: &ObjectView<'_>) -> Option<Self> {
        let bounding_box = object.shape().image_box(view.frame.camera(), &view.world_from_camera)?;
        let camera_from_world = view.world_from_camera.inverse();
        let corners = object.oriented_box().corners();
        let [low, high] = bounds(corners.map(|corner| camera_from_world.transform_point(corner)));
        let depths = Some([low[2] as f32, high[2] as f32]);
        Some(Self { label: object.label(), bounding_box, depths })
    }

    /// Its part in a detection's box, where it may be told from the thing that the detection means.
    pub(super) fn within(&self, detected: &BoundingBox) -> Option<Self> {
        if detected.share_in(&self.bounding_box) >= MOST_COVERED {
            return None;
        }
        let sides = [
            self.bounding_box.x_min().max(detected.x_min()),
            self.bounding_box.y_min().max(detected.y_min()),
            self.bounding_box.x_max().min(detected.x_max()),
            self.bounding_box.y_max().min(detected.y_max()),
        ];
        BoundingBox::try_from(sides).ok().map(|bounding_box| Self { bounding_box, ..*self })
    }

    /// Whether a cluster shows this thing rather than the one of the detection's box.
    pub(super) fn is_shown_by(
        &self,
        cluster: &BoxCluster,
        bounds: &BoundingBox,
        detected: &BoundingBox,
    ) -> bool {
        let is_at_its_depth = self.depths.is_none_or(|[low, high]| (low..=high).contains(&cluster.depth));
        let fit = bounds.iou(&self.bounding_box);
        is_at_its_depth && fit >= FITS && fit > CLEARLY * bounds.iou(detected)
    }
}
