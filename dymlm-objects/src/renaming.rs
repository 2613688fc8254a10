use std::collections::BTreeMap;

use dymlm_core::{ObjectId, PlaneId};

use crate::ObjectMapper;

/// The ids of a map that was built before, for one that takes its place.
impl ObjectMapper {
    /// Takes the place of a map that was built of the same frames: the objects of `names` (id here -> id of
    /// an object there, no two alike) are called so from now on, all others get ids that neither map ever
    /// gave. Ids that led to other objects there lead there still; those of `merged` (id of an object there
    /// -> id that one of `names` has now) lead to what they became. `plane_names` are the new ids of the
    /// planes that things stand on.
    ///
    /// Gives the new id of each id that this map ever gave. Nothing but ids changes. O(objects).
    pub fn succeed(
        &mut self,
        before: &Self,
        names: &BTreeMap<ObjectId, ObjectId>,
        merged: &BTreeMap<ObjectId, ObjectId>,
        plane_names: &BTreeMap<PlaneId, PlaneId>,
    ) -> BTreeMap<ObjectId, ObjectId> {
        let mut next = before.map.next_id.max(self.map.next_id);
        let mut fresh = || {
            next += 1;
            ObjectId::new(next - 1)
        };
        let given = (0..self.map.next_id).map(ObjectId::new);
        let all: BTreeMap<ObjectId, ObjectId> =
            given.map(|id| (id, names.get(&id).copied().unwrap_or_else(&mut fresh))).collect();
        self.map.next_id = next;
        let new_id = |id: ObjectId| all.get(&id).copied().unwrap_or(id);

        for object in &mut self.map.objects {
            self.map.index.remove(object.id);
            object.id = new_id(object.id);
        }
        self.map.objects.sort_unstable_by_key(|object| object.id);
        self.map.objects.iter().for_each(|object| self.map.index.place(object));
        let own = std::mem::take(&mut self.map.absorbed_by).into_iter();
        let own = own.map(|(from, into)| (new_id(from), new_id(into)));
        let inherited = before.map.absorbed_by.iter().chain(merged).map(|(&from, &into)| (from, into));
        let inherited = inherited.filter(|(from, _)| self.map.place(*from).is_none());
        self.map.absorbed_by = inherited.chain(own).collect();
        for ids in [&mut self.held, &mut self.changed] {
            *ids = ids.iter().map(|&id| new_id(id)).collect();
        }
        self.call_planes(|id| plane_names.get(&id).copied().unwrap_or(id));
        all
    }
}
