use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

use dymlm_core::{ObjectId, PlaneId, Succession};

use crate::{ObjectMap, ObjectMapper};

/// Carries the ids of an earlier map over to a map that replaces it.
impl ObjectMapper {
    /// How many ids the map has given; they are counted from 0.
    pub fn ids_given(&self) -> u64 {
        self.map.names.given()
    }

    /// Replaces the map `before`, which was built from the same frames: from now on objects have the ids of
    /// `ids`, and their supporting planes those of `plane_ids`. Ids that led to other objects in `before`
    /// still do; the ids in `merged` (id of an object of `before` -> present id of the object that it has
    /// become, which is among `ids`) lead to these objects.
    ///
    /// Only ids change, and no result of the map depends on them. O(objects).
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
        self.rename_planes(|id| plane_ids.of(id));
    }
}
