use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::{PlaneId, Succession};

use super::PlaneMap;

/// The ids of a map that was built before, for one that takes its place.
impl PlaneMap {
    /// How many ids the map has given, from 0 on.
    pub fn ids_given(&self) -> u64 {
        self.names.given()
    }

    /// Takes the place of a map that was built of the same key frames: planes are called by `ids` from now
    /// on. Ids that led to other planes there lead there still; those of `merged` (id of a plane there -> id
    /// that one of `ids` has now) lead to what they became.
    ///
    /// Nothing but ids changes, and nothing that the map does depends on them. O(planes, also merged ones).
    pub fn succeed(
        &mut self,
        before: &Self,
        ids: &mut Succession<PlaneId>,
        merged: &BTreeMap<PlaneId, PlaneId>,
    ) {
        let planes: Vec<_> = self.planes.keys().copied().collect();
        self.names.succeed(planes.iter().copied().chain(self.merged.merged()), ids);
        for plane in &planes {
            let id = self.names.id(*plane);
            if self.planes.get(plane).is_some_and(|plane| plane.id != id)
                && let Some(plane) = self.planes.get_mut(plane)
            {
                plane.id = id;
            }
        }
        let in_map: BTreeSet<PlaneId> = self.planes.values().map(|plane| plane.id).collect();
        self.merged_ids.succeed(ids, merged, &before.merged_ids, |id| in_map.contains(&id));
        self.names.give_until(ids.given());
    }
}
