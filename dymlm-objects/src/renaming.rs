use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use dymlm_core::{ObjectId, PlaneId, Succession};

use crate::{ObjectMap, ObjectMapper};

/// The ids of a map that was built before, for one that takes its place.
impl ObjectMapper {
    /// How many ids the map has given, from 0 on.
    pub fn ids_given(&self) -> u64 {
        self.map.names.given()
    }

    /// Takes the place of a map that was built of the same frames: objects are called by `ids` from now on,
    /// the planes that they stand on by `plane_ids`. Ids that led to other objects there lead there still;
    /// those of `merged` (id of an object there -> id that one of `ids` has now) lead to what they became.
    ///
    /// Nothing but ids changes, and nothing that the map does depends on them. O(objects).
    pub fn succeed(
        &mut self,
        before: &Self,
        ids: &mut Succession<ObjectId>,
        merged: &BTreeMap<ObjectId, ObjectId>,
        plane_ids: &mut Succession<PlaneId>,
    ) {
        let ObjectMap { objects, names, absorbed_by, .. } = &mut self.map;
        names.succeed(objects.iter().map(|object| object.birth), ids);
        for object in objects.iter_mut() {
            let id = names.id(object.birth);
            if id != object.id {
                Arc::make_mut(object).id = id;
            }
        }
        let in_map: BTreeSet<ObjectId> = objects.iter().map(|object| object.id).collect();
        absorbed_by.succeed(ids, merged, &before.map.absorbed_by, |id| in_map.contains(&id));
        names.give_until(ids.given());
        self.call_planes(|id| plane_ids.of(id));
    }
}
