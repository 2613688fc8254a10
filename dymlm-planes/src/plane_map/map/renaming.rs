use std::collections::BTreeMap;

use dymlm_core::PlaneId;

use super::super::gap_record::pair_of;
use super::PlaneMap;
use crate::patches::PlaneIndex;

/// The ids of a map that was built before, for one that takes its place.
impl PlaneMap {
    /// Takes the place of a map that was built of the same key frames: the planes of `names` (id here -> id
    /// of a plane there, no two alike) are called so from now on, all others get ids that neither map ever
    /// gave. Ids that led to other planes there lead there still; those of `merged` (id of a plane there ->
    /// id that one of `names` has now) lead to what they became.
    ///
    /// Gives the new id of each id that this map ever gave. Nothing but ids changes. O(what the key frames
    /// have seen).
    pub fn succeed(
        &mut self,
        before: &Self,
        names: &BTreeMap<PlaneId, PlaneId>,
        merged: &BTreeMap<PlaneId, PlaneId>,
    ) -> BTreeMap<PlaneId, PlaneId> {
        let mut next = before.next_plane.max(self.next_plane);
        let mut fresh = || {
            next += 1;
            PlaneId::new(next - 1)
        };
        let given = (0..self.next_plane).map(PlaneId::new);
        let all: BTreeMap<PlaneId, PlaneId> =
            given.map(|id| (id, names.get(&id).copied().unwrap_or_else(&mut fresh))).collect();
        self.next_plane = next;
        let new_id = |id: PlaneId| all.get(&id).copied().unwrap_or(id);

        let planes = std::mem::take(&mut self.planes).into_values().map(|mut plane| {
            plane.id = new_id(plane.id);
            (plane.id, plane)
        });
        self.planes = planes.collect();
        self.index = PlaneIndex::default();
        for (&id, plane) in &self.planes {
            plane.patch.blocks().for_each(|block| self.index.add(block, id));
        }
        let own = std::mem::take(&mut self.merged).into_iter();
        let own = own.map(|(from, into)| (new_id(from), new_id(into)));
        let inherited = before.merged.iter().chain(merged).map(|(&from, &into)| (from, into));
        self.merged = inherited.filter(|(from, _)| !self.planes.contains_key(from)).chain(own).collect();
        for key_frame in self.key_frames.values_mut() {
            key_frame.shares.iter_mut().for_each(|share| share.plane = new_id(share.plane));
            key_frame.missed.iter_mut().for_each(|id| *id = new_id(*id));
            for merge in &mut key_frame.merges {
                merge.merge.from = new_id(merge.merge.from);
                merge.merge.into = new_id(merge.merge.into);
            }
            for (pair, _) in &mut key_frame.gap_looks {
                *pair = pair_of(new_id(pair[0]), new_id(pair[1]));
            }
            key_frame.gap_looks.sort_unstable();
        }
        self.collect_gaps();
        all
    }
}
