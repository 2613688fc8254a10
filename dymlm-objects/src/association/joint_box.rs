use dymlm_core::Pose;
use dymlm_core::vector3::{Vector3, difference, norm};
use dymlm_geometry::OrientedBox;

use super::visible_iou;
use crate::optimization::{MAX_IOU_LOSS, PRIOR_SLACK};
use crate::{MapObject, ObjectObservation, ObjectShape, ObjectView, SizePriors};

/// The box around an object and an observation, along the object's axes.
#[derive(Debug, Clone, Copy)]
pub(crate) struct JointBox(OrientedBox);

impl JointBox {
    /// `places` are the observation's points in the world.
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

    /// Whether the object may fill it: things of its label may be so large, and the object's earlier views are
    /// explained as well as by its own box.
    pub(crate) fn fits(&self, object: &MapObject, priors: &SizePriors) -> bool {
        let prior = priors.of(&object.label);
        let is_plausible =
            prior.is_none_or(|prior| prior.admits_part(self.0.lengths(), object.axes.pose(), PRIOR_SLACK));
        is_plausible && object.key_views.mean_iou(&self.shape(object)) >= least_iou(object)
    }

    fn shape(&self, object: &MapObject) -> ObjectShape {
        ObjectShape::new(object.shape, self.0)
    }
}

/// How well a box must fit a view to explain it as well as the object's own box does its earlier ones.
fn least_iou(object: &MapObject) -> Option<f64> {
    object.key_views.mean_iou(&object.shape()).map(|own| own - MAX_IOU_LOSS)
}

/// How well the box around an object and an observation fits the detected box; `None` unless it explains that
/// and the object's earlier views as well as the object's own box does these.
pub(super) fn joint_iou(
    view: &ObjectView<'_>,
    observation: &ObjectObservation,
    places: &[Vector3],
    object: &MapObject,
    priors: &SizePriors,
) -> Option<f64> {
    let (own, other) = (object.oriented_box, observation.fit.oriented_box);
    let reach = 0.5 * (norm(own.lengths()) + norm(other.lengths()));
    if norm(difference(own.center(), other.center())) > reach {
        return None;
    }
    let joint = JointBox::around(object, places)?;
    let camera = view.frame.camera();
    let projected = joint.shape(object).image_box(camera, &view.world_from_camera)?;
    let iou = visible_iou(&projected, &observation.bounding_box, observation.completeness, camera);
    (Some(iou) >= least_iou(object) && joint.fits(object, priors)).then_some(iou)
}
