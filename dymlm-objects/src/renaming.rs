use std::collections::BTreeMap;
use std::sync::Arc;

use dymlm_core::{ObjectId, PlaneId, Succession};

use crate::ObjectMapper;

/// The ids of a map that was built before, for one that takes its place.
impl ObjectMapper {
    /// How many ids the map has given, from 0 on.
    pub fn ids_given(&self) -> u64 {
        self.map.next_id
    }

    /// Takes the place of a map that was built of the same frames: objects are called by `ids` from now on,
    /// the planes that they stand on by `plane_ids`. Ids that led to other objects there lead there still;
    /// those of `merged` (id of an object there -> id that one of `ids` has now) lead to what they became.
    ///
    /// Nothing but ids changes. O(objects).
    pub fn succeed(
        &mut self,
        before: &Self,
        ids: &mut Succession<ObjectId>,
        merged: &BTreeMap<ObjectId, ObjectId>,
        plane_ids: &mut Succession<PlaneId>,
    ) {
        for object in &mut self.map.objects {
            self.map.index.remove(object.id);
            let id = ids.of(object.id);
            if id != object.id {
                Arc::make_mut(object).id = id;
            }
        }
        self.map.objects.sort_unstable_by_key(|object| object.id);
        self.map.objects.iter().for_each(|object| self.map.index.place(object));
        let mut absorbed_by = std::mem::take(&mut self.map.absorbed_by);
        let is_in_map = |id| self.map.place(id).is_some();
        absorbed_by.succeed(ids, merged, &before.map.absorbed_by, is_in_map);
        self.map.absorbed_by = absorbed_by;
        for noted in [&mut self.held, &mut self.changed] {
            *noted = noted.iter().map(|&id| ids.of(id)).collect();
        }
        self.map.next_id = ids.given();
        self.call_planes(|id| plane_ids.of(id));
    }
}
