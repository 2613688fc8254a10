use std::collections::BTreeMap;

use dymlm_core::{PlaneId, Succession};

use super::super::gap_record::pair_of;
use super::PlaneMap;
use crate::patches::PlaneIndex;

/// The ids of a map that was built before, for one that takes its place.
impl PlaneMap {
    /// How many ids the map has given, from 0 on.
    pub fn ids_given(&self) -> u64 {
        self.next_plane
    }

    /// Takes the place of a map that was built of the same key frames: planes are called by `ids` from now
    /// on. Ids that led to other planes there lead there still; those of `merged` (id of a plane there -> id
    /// that one of `ids` has now) lead to what they became.
    ///
    /// Nothing but ids changes. O(what the key frames have seen).
    pub fn succeed(
        &mut self,
        before: &Self,
        ids: &mut Succession<PlaneId>,
        merged: &BTreeMap<PlaneId, PlaneId>,
    ) {
        let planes = std::mem::take(&mut self.planes).into_values().map(|mut plane| {
            plane.id = ids.of(plane.id);
            (plane.id, plane)
        });
        self.planes = planes.collect();
        self.index = PlaneIndex::default();
        for (&id, plane) in self.planes.iter() {
            plane.patch.blocks().for_each(|block| self.index.add(block, id));
        }
        self.merged.succeed(ids, merged, &before.merged, |id| self.planes.contains_key(&id));
        for key_frame in self.key_frames.values_mut() {
            key_frame.shares.iter_mut().for_each(|share| share.plane = ids.of(share.plane));
            key_frame.missed.iter_mut().for_each(|id| *id = ids.of(*id));
            for merge in &mut key_frame.merges {
                merge.merge.from = ids.of(merge.merge.from);
                merge.merge.into = ids.of(merge.merge.into);
            }
            for (pair, _) in &mut key_frame.gap_looks {
                *pair = pair_of(ids.of(pair[0]), ids.of(pair[1]));
            }
            key_frame.gap_looks.sort_unstable();
        }
        self.next_plane = ids.given();
        self.collect_gaps();
    }
}
