use std::collections::BTreeMap;
use std::iter::successors;

use crate::Succession;

/// What the ids of merged things lead to: each to the thing that its own was merged into, and on from there.
///
/// No id ever leads back to itself, so that each chain ends.
///
/// ```
/// use dymlm_core::{MergedIds, PlaneId};
///
/// let [a, b, c] = [0, 1, 2].map(PlaneId::new);
/// let mut merged = MergedIds::default();
/// assert!(merged.insert(a, b) && merged.insert(b, c));
/// assert_eq!(merged.current(a), c);
/// assert!(!merged.insert(c, a));
/// assert_eq!(merged.current(c), c);
/// ```
#[derive(Debug, Clone)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "BTreeMap<Id, Id>", into = "BTreeMap<Id, Id>"))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "Id: Copy + Ord + serde::Serialize",
        deserialize = "Id: Copy + Ord + serde::Deserialize<'de>"
    ))
)]
pub struct MergedIds<Id> {
    into: BTreeMap<Id, Id>,
    revision: u64,
}

impl<Id> Default for MergedIds<Id> {
    fn default() -> Self {
        Self { into: BTreeMap::new(), revision: 0 }
    }
}

/// How often they have changed is no part of what they are.
impl<Id: PartialEq> PartialEq for MergedIds<Id> {
    fn eq(&self, other: &Self) -> bool {
        self.into == other.into
    }
}

impl<Id: Eq> Eq for MergedIds<Id> {}

impl<Id: Copy + Ord> MergedIds<Id> {
    /// The id that an id leads to: itself unless its thing was merged. O(merges on the way).
    pub fn current(&self, id: Id) -> Id {
        self.way_from(id).last().unwrap_or(id)
    }

    /// An id, and all ids that it leads to, one after the other.
    fn way_from(&self, id: Id) -> impl Iterator<Item = Id> {
        successors(Some(id), |id| self.into.get(id).copied())
    }

    /// Lets an id lead to another. Changes nothing and returns `false` when the other leads back to it.
    pub fn insert(&mut self, from: Id, into: Id) -> bool {
        // An id that leads on already is not the end of the way, but may lie on it.
        let is_open = self.way_from(into).all(|id| id != from);
        if is_open {
            self.revision += 1;
            self.into.insert(from, into);
        }
        is_open
    }

    /// Lets an id stand for its own thing again.
    pub fn remove(&mut self, from: Id) {
        self.revision += 1;
        self.into.remove(&from);
    }

    /// A number that grows whenever an id may lead elsewhere than before: who has followed all ids needs to do
    /// so again only when it has changed. It is not saved.
    pub fn revision(&self) -> u64 {
        self.revision
    }

    /// Forgets the ids that do not lead to one that `stays`.
    pub fn retain(&mut self, stays: impl Fn(Id) -> bool) {
        self.revision += 1;
        let leading: Vec<Id> = self.into.keys().copied().filter(|&from| stays(self.current(from))).collect();
        self.into.retain(|from, _| leading.binary_search(from).is_ok());
    }

    /// The ids of all things that were merged, ascending.
    pub fn merged(&self) -> impl Iterator<Item = Id> {
        self.into.keys().copied()
    }

    /// Whether an id is that of a thing that was merged.
    pub fn has_merged(&self, id: Id) -> bool {
        self.into.contains_key(&id)
    }

    /// Replaces all ids by new ones.
    ///
    /// These are the merges of a map that replaces another map: the merges there (`before`) still hold, and
    /// the ids of things that became part of another thing only now (`merged`) lead to that thing. Not taken
    /// over are ids of things that the new map has on their own, and merges that would close a circle with
    /// the new map's own. Of its own merges, those stay whose id is among `ids` already, with what that id
    /// leads through: nobody knows the others, or knows them from `before`, and with new ids they would
    /// become more with each map that begins from an earlier state of its own.
    pub fn succeed(
        &mut self,
        ids: &mut Succession<Id>,
        merged: &BTreeMap<Id, Id>,
        before: &Self,
        is_in_map: impl Fn(Id) -> bool,
    ) {
        self.revision += 1;
        let own = self.chains_from(|id| ids.get(id).is_some());
        self.into = own.into_iter().map(|(from, into)| (ids.of(from), ids.of(into))).collect();
        for (&from, &into) in merged.iter().chain(&before.into) {
            if !is_in_map(from) && !self.into.contains_key(&from) {
                self.insert(from, into);
            }
        }
    }

    /// The merges of the ids that are `known`, and those that they lead through.
    fn chains_from(&self, known: impl Fn(Id) -> bool) -> BTreeMap<Id, Id> {
        let mut chains = BTreeMap::new();
        for &from in self.into.keys().filter(|from| known(**from)) {
            let mut id = from;
            while let Some(&into) = self.into.get(&id)
                && chains.insert(id, into).is_none()
            {
                id = into;
            }
        }
        chains
    }

    /// Bytes held, approximately.
    pub fn memory_bytes(&self) -> usize {
        self.into.len() * size_of::<[Id; 2]>()
    }
}

#[cfg(feature = "serde")]
impl<Id: Copy + Ord> TryFrom<BTreeMap<Id, Id>> for MergedIds<Id> {
    type Error = &'static str;

    fn try_from(into: BTreeMap<Id, Id>) -> Result<Self, Self::Error> {
        let mut merged = Self::default();
        let is_open = into.into_iter().all(|(from, into)| merged.insert(from, into));
        if is_open { Ok(merged) } else { Err("ids that lead round in a circle") }
    }
}

#[cfg(feature = "serde")]
impl<Id> From<MergedIds<Id>> for BTreeMap<Id, Id> {
    fn from(merged: MergedIds<Id>) -> Self {
        merged.into
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ObjectId;

    #[cfg(feature = "serde")]
    #[test]
    fn ids_that_lead_round_in_a_circle_are_not_read() {
        let json = serde_json::to_string(&merged(&[[4, 2], [2, 7]])).unwrap();
        assert_eq!(serde_json::from_str::<MergedIds<ObjectId>>(&json).unwrap(), merged(&[[4, 2], [2, 7]]));
        for circle in [r#"{"1": 1}"#, r#"{"4": 2, "2": 7, "7": 4}"#] {
            assert!(serde_json::from_str::<MergedIds<ObjectId>>(circle).is_err());
        }
    }

    fn merged(pairs: &[[u64; 2]]) -> MergedIds<ObjectId> {
        let mut merged = MergedIds::default();
        for pair in pairs {
            let [from, into] = pair.map(ObjectId::new);
            assert!(merged.insert(from, into));
        }
        merged
    }

    fn current(merged: &MergedIds<ObjectId>, id: u64) -> u64 {
        merged.current(ObjectId::new(id)).get()
    }

    #[test]
    fn a_merged_id_leads_to_what_it_became() {
        let merged = merged(&[[4, 2], [2, 7]]);
        assert_eq!([4, 2, 7, 9].map(|id| current(&merged, id)), [7, 7, 7, 9]);
    }

    #[test]
    fn a_change_of_what_ids_lead_to_shows_in_the_revision() {
        let mut merged = merged(&[[4, 2]]);
        let before = (merged.clone(), merged.revision());
        assert!(!merged.insert(ObjectId::new(2), ObjectId::new(4)));
        assert_eq!(merged.revision(), before.1);
        assert!(merged.insert(ObjectId::new(2), ObjectId::new(7)));
        let merged_twice = merged.revision();
        merged.remove(ObjectId::new(2));
        // The same merges again, but who has followed 2 to 7 must look again.
        assert_eq!(merged, before.0);
        assert!(before.1 < merged_twice && merged_twice < merged.revision());
    }

    /// An id that already leads on is on the way from another id without being its end.
    #[test]
    fn an_id_that_leads_on_does_not_lead_back_to_itself() {
        let mut merged = merged(&[[0, 2], [1, 0]]);
        let before = (merged.clone(), merged.revision());
        assert!(!merged.insert(ObjectId::new(0), ObjectId::new(1)));
        assert!(!merged.insert(ObjectId::new(0), ObjectId::new(0)));
        assert_eq!((&merged, merged.revision()), (&before.0, before.1));
        assert_eq!([0, 1].map(|id| current(&merged, id)), [2, 2]);
        // Elsewhere it may lead.
        assert!(merged.insert(ObjectId::new(0), ObjectId::new(3)));
        assert_eq!([0, 1].map(|id| current(&merged, id)), [3, 3]);
    }

    #[test]
    fn what_does_not_lead_to_anything_that_stays_is_forgotten() {
        let mut merged = merged(&[[4, 2], [2, 7], [5, 6]]);
        merged.retain(|id| id.get() == 7);
        assert_eq!([4, 2, 5].map(|id| current(&merged, id)), [7, 7, 5]);
    }

    /// Before, 0 went into 1, and 2 into 3; in the new map 1 into 2, and 3 into 0. None of these things is in
    /// the map.
    #[test]
    fn merges_of_two_maps_do_not_lead_round_in_a_circle() {
        let before = merged(&[[0, 1], [2, 3]]);
        let mut now = merged(&[[1, 2], [3, 0]]);
        let same = (0..4).map(|id| (ObjectId::new(id), ObjectId::new(id))).collect();
        let mut ids = Succession::new(same, [4, 4], ObjectId::new);
        now.succeed(&mut ids, &BTreeMap::new(), &before, |_| false);
        // Each chain ends, and the new map's merges hold.
        let ends = [0, 1, 2, 3].map(|id| current(&now, id));
        assert_eq!((ends[1], ends[3]), (ends[2], ends[0]));
    }

    /// A map is built again from an earlier state of its own, again and again: what merged long ago, and
    /// what nobody asks for, is not there once more each time.
    #[test]
    fn old_merges_are_not_doubled_by_each_new_map() {
        let mut map = merged(&[[4, 2], [2, 7], [5, 6]]);
        let mut given = 8;
        for _ in 0..10 {
            let mut next = map.clone();
            let names = BTreeMap::from([(ObjectId::new(7), ObjectId::new(7))]);
            let mut ids = Succession::new(names, [given, given], ObjectId::new);
            next.succeed(&mut ids, &BTreeMap::new(), &map, |id| id.get() == 7);
            (map, given) = (next, ids.given());
            assert_eq!((map.merged().count(), given), (3, 8));
            assert_eq!([4, 2, 5].map(|id| current(&map, id)), [7, 7, 6]);
        }
    }

    /// The plane of an id that an observation still names goes on through one that nothing names.
    #[test]
    fn the_way_from_an_id_that_is_known_is_kept_whole() {
        let names =
            BTreeMap::from([(ObjectId::new(0), ObjectId::new(3)), (ObjectId::new(2), ObjectId::new(4))]);
        let mut ids = Succession::new(names, [5, 3], ObjectId::new);
        let mut now = merged(&[[0, 1], [1, 2]]);
        now.succeed(&mut ids, &BTreeMap::new(), &MergedIds::default(), |id| id.get() == 4);
        assert_eq!((current(&now, 3), now.merged().count()), (4, 2));
    }

    #[test]
    fn what_a_new_map_has_by_itself_leads_nowhere() {
        let before = merged(&[[0, 1]]);
        let names = BTreeMap::from([(ObjectId::new(0), ObjectId::new(0))]);
        let mut ids = Succession::new(names, [3, 1], ObjectId::new);
        let mut now = MergedIds::default();
        let became = BTreeMap::from([(ObjectId::new(2), ObjectId::new(0))]);
        now.succeed(&mut ids, &became, &before, |id| id.get() == 0);
        assert_eq!([0, 1, 2].map(|id| current(&now, id)), [0, 1, 0]);
    }
}
