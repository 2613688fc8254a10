use dymlm_core::Pose;
use dymlm_core::vector3::{Vector3, difference};
use dymlm_geometry::OrientedBox;

use super::visible_iou;
use crate::optimization::{MAX_IOU_LOSS, PRIOR_SLACK, may_touch};
use crate::{MapObject, ObjectObservation, ObjectShape, ObjectView, SizePriors};

/// The box around an object and an observation, along the object's axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointBox(OrientedBox);

impl JointBox {
    /// The joint box; `places` are the observation's points in the world.
    pub(crate) fn around(object: &MapObject, places: &[Vector3]) -> Option<Self> {
        let own = object.oriented_box;
        let box_from_world = own.world_from_box().inverse();
        let half = own.lengths().map(|length| 0.5 * length);
        let (mut low, mut high) = (half.map(|c| -c), half);
        for place in places.iter().map(|&place| box_from_world.transform_point(place)) {
            for axis in 0..3 {
                low[axis] = low[axis].min(place[axis]);
                high[axis] = high[axis].max(place[axis]);
            }
        }
        let middle = [0, 1, 2].map(|axis| f64::midpoint(low[axis], high[axis]));
        let center = own.world_from_box().transform_point(middle);
        let pose = Pose::new(center, own.world_from_box().quaternion()).ok()?;
        OrientedBox::new(pose, difference(high, low)).ok().map(Self)
    }

    /// Whether the object may fill the joint box: it is not too large for the label, and it explains the
    /// object's earlier views as well as the object's own box does. Here a projection may not reach beyond
    /// cut sides of a detection either: nothing unseen beside the object is taken for a part of it, only what
    /// may be behind it.
    pub(crate) fn fits(&self, object: &MapObject, priors: &SizePriors) -> bool {
        let pose = object.axes.pose();
        let views = &object.key_views;
        let own = views.mean_whole_iou(&object.shape()).map(|own| own - MAX_IOU_LOSS);
        priors.admit_part(&object.label, self.0.lengths(), pose, PRIOR_SLACK)
            && views.mean_whole_iou(&self.shape(object)) >= own
    }

    fn shape(&self, object: &MapObject) -> ObjectShape {
        ObjectShape::new(object.shape, self.0)
    }
}

/// Intersection over union of the detected box with the projection of the joint box; `None` unless the joint
/// box explains the detection and the object's earlier views as well as the object's own box explains the
/// latter.
pub(super) fn joint_iou(
    view: &ObjectView<'_>,
    observation: &ObjectObservation,
    places: &[Vector3],
    object: &MapObject,
    priors: &SizePriors,
) -> Option<f64> {
    if !may_touch(&object.oriented_box, &observation.fit.oriented_box) {
        return None;
    }
    let joint = JointBox::around(object, places)?;
    let camera = view.frame.camera();
    let projected = joint.shape(object).image_box(camera, &view.world_from_camera)?;
    let iou = visible_iou(&projected, &observation.bounding_box, observation.completeness, camera);
    let own = object.key_views.mean_iou(&object.shape())?;
    (iou >= own - MAX_IOU_LOSS && joint.fits(object, priors)).then_some(iou)
}
