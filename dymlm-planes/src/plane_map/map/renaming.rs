use std::collections::{BTreeMap, BTreeSet};

use dymlm_core::{PlaneId, Succession};

use super::PlaneMap;

/// Carries the ids of an earlier map over to a map that replaces it.
impl PlaneMap {
    /// How many ids the map has given; they are counted from 0.
    pub fn ids_given(&self) -> u64 {
        self.names.given()
    }

    /// Replaces the map `before`, which was built from the same key frames: from now on planes have the ids
    /// of `ids`. Ids that led to other planes in `before` still do; the ids in `merged` (id of a plane of
    /// `before` -> present id of the plane that it has become, which is among `ids`) lead to these planes.
    ///
    /// Only ids change, and no result of the map depends on them. O(planes, including merged ones).
    pub fn succeed(
        &mut self,
        before: &Self,
        ids: &mut Succession<PlaneId>,
        merged: &BTreeMap<PlaneId, PlaneId>,
    ) {
        let planes: Vec<_> = self.planes.keys().copied().collect();
        let may_come_back = self.dropped.keys().copied();
        self.names.succeed(planes.iter().copied().chain(self.merged.merged()).chain(may_come_back), ids);
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
