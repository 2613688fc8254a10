use std::collections::BTreeMap;

/// The ids of things in a map that replaces another map: some things keep the ids that they had in the map
/// before, all others get ids that neither map ever gave, when they are first asked for.
///
/// ```
/// use std::collections::BTreeMap;
/// use dymlm_core::{PlaneId, Succession};
///
/// // The new map's plane 1 is what was plane 4. Five ids were given before, and two now.
/// let names = BTreeMap::from([(PlaneId::new(1), PlaneId::new(4))]);
/// let mut ids = Succession::new(names, [5, 2], PlaneId::new);
/// assert_eq!(ids.of(PlaneId::new(1)), PlaneId::new(4));
/// assert_eq!(ids.of(PlaneId::new(0)), PlaneId::new(5));
/// assert_eq!(ids.of(PlaneId::new(0)), PlaneId::new(5));
/// assert_eq!(ids.given(), 6);
/// ```
#[derive(Debug, Clone)]
pub struct Succession<Id> {
    names: BTreeMap<Id, Id>,
    given: u64,
    id: fn(u64) -> Id,
}

impl<Id: Copy + Ord> Succession<Id> {
    /// `names`: id in the new map -> id in the map before, no two equal. `given`: how many ids each of the
    /// maps has given, from 0 on. `id` makes an id from a number.
    pub fn new(names: BTreeMap<Id, Id>, given: [u64; 2], id: fn(u64) -> Id) -> Self {
        Self { names, given: given[0].max(given[1]), id }
    }

    /// The id that a thing of the new map has from now on.
    pub fn of(&mut self, own: Id) -> Id {
        *self.names.entry(own).or_insert_with(|| {
            self.given += 1;
            (self.id)(self.given - 1)
        })
    }

    /// The id that a thing of the new map has from now on, if it was kept or has been asked for.
    pub fn get(&self, own: Id) -> Option<Id> {
        self.names.get(&own).copied()
    }

    /// How many ids have been given, from 0 on.
    pub fn given(&self) -> u64 {
        self.given
    }
}
