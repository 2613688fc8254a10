use std::collections::BTreeMap;

/// The ids of things in a map that takes the place of another: some are called as they were in the map
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
    /// `names`: id in the new map -> id in the one before, no two alike. `given`: how many ids either map has
    /// given, from 0 on. `id` makes one of a number.
    pub fn new(names: BTreeMap<Id, Id>, given: [u64; 2], id: fn(u64) -> Id) -> Self {
        Self { names, given: given[0].max(given[1]), id }
    }

    /// What a thing of the new map is called from now on.
    pub fn of(&mut self, own: Id) -> Id {
        *self.names.entry(own).or_insert_with(|| {
            self.given += 1;
            (self.id)(self.given - 1)
        })
    }

    /// What a thing of the new map is called, if that was asked or given.
    pub fn get(&self, own: Id) -> Option<Id> {
        self.names.get(&own).copied()
    }

    /// How many ids have been given, from 0 on.
    pub fn given(&self) -> u64 {
        self.given
    }
}
