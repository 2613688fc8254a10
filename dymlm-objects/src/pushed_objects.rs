use std::sync::Arc;

use dymlm_core::vector3::{bounds, boxes_touch, difference};
use dymlm_core::{Birth, ObjectId, Pose};

use crate::{MapObject, ObjectMapper, ObjectShape, SupportingPlanes};

/// Objects that somebody pushes along while they are seen.
impl ObjectMapper {
    /// The objects that were observed after a time (seconds), whose box reaches into a region (lowest and
    /// highest corner, metres, world), and in whose parameters points for which `is_free` holds have a say.
    /// Where one of them was pushed along it [follows](Self::follow_pushed). An object that is not seen any more
    /// is judged [as a whole](Self::remove_where); carried ones are left out.
    pub fn partly_free(
        &mut self,
        region: [[f64; 3]; 2],
        since: f64,
        is_free: impl Fn([f64; 3]) -> bool,
    ) -> Vec<ObjectId> {
        let Self { map, held, reparameterizer, near, .. } = self;
        map.index.within(region, near);
        let born = near.iter().filter(|birth| !held.contains_key(birth)).filter_map(|&birth| map.born(birth));
        let mut is_asked = |object: &&MapObject| {
            object.last_seen > since
                && boxes_touch(bounds(object.oriented_box.corners()), region)
                && reparameterizer.is_shaped_by(object, &is_free)
        };
        born.filter(|object| is_asked(object)).map(|object| object.id).collect()
    }

    /// Lets objects follow somebody who has pushed them along: a thing that is seen where it stands now loses
    /// the points for which `is_free` holds, those of its old place, and is fitted anew. An object stays as it
    /// is when its last observation does not fit the new parameters clearly better than the old ones. It also
    /// stays when the other things there that were observed after a time (seconds) are displaced as it is: then
    /// the camera is not where it is said to be.
    ///
    /// Returns those that have new parameters.
    pub fn follow_pushed(
        &mut self,
        objects: &[ObjectId],
        since: f64,
        is_free: impl Fn([f64; 3]) -> bool,
        planes: &dyn SupportingPlanes,
    ) -> Vec<ObjectId> {
        let mut updated = Vec::new();
        for &id in objects {
            let Some(place) = self.map.object(id).and_then(|object| self.map.place(object.birth)) else {
                continue;
            };
            let Some(old) = self.map.objects.get(place).map(Arc::clone) else { continue };
            let mut new = MapObject::clone(&old);
            let (vertical, config) = (self.vertical.direction(), &self.config);
            let (sizes, shapes) = (&config.sizes, &config.shapes);
            let has_moved = self.reparameterizer.follow(&mut new, &is_free, vertical, sizes, shapes, planes);
            if has_moved && !self.others_are_displaced(&old, &new, since) {
                self.map.index.place(&new);
                self.changed.insert(new.birth);
                updated.push(id);
                if let Some(object) = self.map.objects.get_mut(place) {
                    *object = Arc::new(new);
                }
            }
        }
        updated
    }

    /// Whether the other things in an object's last view that were observed after a time fit the detections of
    /// them better when they are displaced like the object.
    fn others_are_displaced(&mut self, old: &MapObject, new: &MapObject, since: f64) -> bool {
        let Some(view) = old.key_views.newest() else { return false };
        let displacement = difference(new.oriented_box.center(), old.oriented_box.center());
        let Ok(displaced) = Pose::new(displacement, [0.0, 0.0, 0.0, 1.0]) else { return false };
        let max_depth = self.sensor.max_depth.into();
        self.map.index.in_view(&self.map, &view.camera, &view.world_from_camera, max_depth, &mut self.near);
        let is_other = |&birth: &Birth| birth != old.birth && !self.held.contains_key(&birth);
        let others = self.near.iter().copied().filter(is_other).filter_map(|birth| self.map.born(birth));
        let gain = |other: &MapObject| {
            let view = other.key_views.newest().filter(|_| other.last_seen > since)?;
            let box_there = other.oriented_box.transformed(&displaced);
            let there = ObjectShape::new(other.shape, box_there);
            Some(view.projection_iou(&there) - view.projection_iou(&other.shape()))
        };
        others.filter_map(gain).sum::<f64>() > 0.0
    }
}
