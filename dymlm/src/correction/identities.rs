use std::collections::{BTreeMap, BTreeSet};

/// Matches the things of a map that was built again with those of the map before, by the observations that
/// they share.
///
/// Pairs that share most observations are matched first. A thing of the new map takes the id of its partner;
/// things without a partner get new ids.
#[derive(Debug, Clone, PartialEq, Default)]
pub(super) struct Identities<Id: Ord> {
    /// Id in the new map -> id in the old map.
    pub(super) names: BTreeMap<Id, Id>,
    /// Old id that no thing has any more -> id (an old one) of the thing that has most of its observations.
    pub(super) merged: BTreeMap<Id, Id>,
    /// New thing without an old id (its id in the new map) -> old thing with which it shares most
    /// observations, and whose id another has.
    pub(super) split: BTreeMap<Id, Id>,
}

impl<Id: Copy + Ord> Identities<Id> {
    /// `shared` has a pair for each observation: the thing that it belonged to, and the thing that it belongs
    /// to now. Both are in the maps.
    pub(super) fn of(shared: impl Iterator<Item = (Id, Id)>) -> Self {
        let pairs = most_frequent_first(shared);
        let (mut names, mut taken) = (BTreeMap::new(), BTreeSet::new());
        name(&pairs, &mut names, &mut taken);
        let (mut merged, mut split) = (BTreeMap::new(), BTreeMap::new());
        for &(old, new) in &pairs {
            if let (false, Some(&name)) = (taken.contains(&old), names.get(&new)) {
                merged.entry(old).or_insert(name);
            }
            if !names.contains_key(&new) {
                split.entry(new).or_insert(old);
            }
        }
        Self { names, merged, split }
    }

    /// `names` with, in addition, the ids of things that are no longer in the new map: so that an id whose
    /// thing comes and goes with corrections stays the same, and ids are not used up. `shared` has the ids
    /// under which the observations were noted.
    pub(super) fn names_of_all(&self, shared: impl Iterator<Item = (Id, Id)>) -> BTreeMap<Id, Id> {
        let mut names = self.names.clone();
        let mut taken = names.values().copied().collect();
        name(&most_frequent_first(shared), &mut names, &mut taken);
        names
    }
}

/// For each old thing, the new thing that has most of its observations.
pub(crate) fn leading_ids<Id: Copy + Ord>(shared: impl Iterator<Item = (Id, Id)>) -> BTreeMap<Id, Id> {
    let mut leading = BTreeMap::new();
    for (old, new) in most_frequent_first(shared) {
        leading.entry(old).or_insert(new);
    }
    leading
}

/// Each pair once, the most frequent first; of equally frequent ones the older ids first.
fn most_frequent_first<Id: Copy + Ord>(shared: impl Iterator<Item = (Id, Id)>) -> Vec<(Id, Id)> {
    let mut counts: BTreeMap<(Id, Id), usize> = BTreeMap::new();
    for pair in shared {
        *counts.entry(pair).or_default() += 1;
    }
    let mut pairs: Vec<((Id, Id), usize)> = counts.into_iter().collect();
    // A stable sort: equally frequent pairs stay in the order of their ids.
    pairs.sort_by_key(|&(_, count)| std::cmp::Reverse(count));
    pairs.into_iter().map(|(pair, _)| pair).collect()
}

/// Gives the new thing of each pair the old one's id, where both are free.
fn name<Id: Copy + Ord>(pairs: &[(Id, Id)], names: &mut BTreeMap<Id, Id>, taken: &mut BTreeSet<Id>) {
    for &(old, new) in pairs {
        if !taken.contains(&old) && !names.contains_key(&new) {
            names.insert(new, old);
            taken.insert(old);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_keep_the_id_with_which_they_share_most() {
        // 7 was seen as 0 three times and as 1 once, 8 as 1 only.
        let shared = [(7, 0), (7, 0), (7, 0), (7, 1), (8, 1), (8, 1)];
        let identities = Identities::of(shared.into_iter());
        assert_eq!(identities.names, BTreeMap::from([(0, 7), (1, 8)]));
        assert!(identities.merged.is_empty() && identities.split.is_empty());
    }

    #[test]
    fn what_is_gone_keeps_its_id_too() {
        // In the new map 1 was merged into 0, as 8 was into 7.
        let identities = Identities::of([(7, 0), (7, 0), (7, 0)].into_iter());
        let names = identities.names_of_all([(7, 0), (8, 1), (7, 0)].into_iter());
        assert_eq!(names, BTreeMap::from([(0, 7), (1, 8)]));
    }

    #[test]
    fn what_has_no_thing_of_its_own_any_more_has_merged_and_the_other_way_round() {
        let merged = Identities::of([(7, 0), (7, 0), (8, 0)].into_iter());
        assert_eq!((merged.names[&0], merged.merged), (7, BTreeMap::from([(8, 7)])));
        let split = Identities::of([(7, 0), (7, 1), (7, 1)].into_iter());
        assert_eq!((split.names[&1], split.split), (7, BTreeMap::from([(0, 7)])));
    }
}
