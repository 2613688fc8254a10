use std::collections::BTreeMap;

use crate::ids::Numbered;
use crate::{Birth, Succession};

/// The ids of the things of a map, and the order in which the things came into it.
///
/// A map keeps, visits and ranks its things by their births. Their ids are names: a map that was built again
/// takes them from the map before, in an order without meaning, and they must not change what the map holds.
///
/// ```
/// use dymlm_core::{Birth, Names, PlaneId};
///
/// let mut names = Names::<PlaneId>::default();
/// assert_eq!(names.add(), (Birth::new(0), PlaneId::new(0)));
/// assert_eq!(names.birth(PlaneId::new(0)), Some(Birth::new(0)));
/// assert_eq!(names.birth(PlaneId::new(1)), None);
/// ```
#[derive(Debug, Clone, PartialEq, Eq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(try_from = "SavedNames<Id>", into = "SavedNames<Id>"))]
#[cfg_attr(
    feature = "serde",
    serde(bound(
        serialize = "Id: Numbered + serde::Serialize",
        deserialize = "Id: Numbered + serde::Deserialize<'de>"
    ))
)]
pub struct Names<Id> {
    births: u64,
    given: u64,
    /// The ids of the things whose id has another number than their birth.
    of_births: BTreeMap<Birth, Id>,
    /// The births of the same things by id.
    births_of: BTreeMap<Id, Birth>,
}

impl<Id> Default for Names<Id> {
    fn default() -> Self {
        Self { births: 0, given: 0, of_births: BTreeMap::new(), births_of: BTreeMap::new() }
    }
}

impl<Id: Numbered> Names<Id> {
    /// Adds a thing to the map, with an id that no other thing ever had.
    pub fn add(&mut self) -> (Birth, Id) {
        let (birth, id) = (Birth::new(self.births), Id::numbered(self.given));
        (self.births, self.given) = (self.births + 1, self.given + 1);
        self.call(birth, id);
        (birth, id)
    }

    /// The id of a thing that is in the map.
    pub fn id(&self, birth: Birth) -> Id {
        self.of_births.get(&birth).copied().unwrap_or(Id::numbered(birth.get()))
    }

    /// The birth of the thing with this id, if it is in the map; for other ids perhaps a birth that no thing
    /// of the map has.
    pub fn birth(&self, id: Id) -> Option<Birth> {
        let same = Some(Birth::new(id.number())).filter(|own| own.get() < self.births);
        let called_so = || same.filter(|own| !self.of_births.contains_key(own));
        self.births_of.get(&id).copied().or_else(called_so)
    }

    /// Forgets the id of a thing that is gone for good.
    pub fn forget(&mut self, birth: Birth) {
        if let Some(id) = self.of_births.remove(&birth) {
            self.births_of.remove(&id);
        }
    }

    /// Forgets the ids of all things but those that stay: that are in the map, or may come back.
    pub fn retain(&mut self, stays: impl Fn(Birth) -> bool) {
        self.of_births.retain(|birth, _| stays(*birth));
        self.births_of.retain(|_, birth| stays(*birth));
    }

    /// Gives new ids to the things that are in the map, or may come back, and forgets the ids of others. No
    /// birth changes.
    pub fn succeed(&mut self, in_map: impl IntoIterator<Item = Birth>, ids: &mut Succession<Id>) {
        let called: Vec<(Birth, Id)> =
            in_map.into_iter().map(|birth| (birth, ids.of(self.id(birth)))).collect();
        (self.of_births, self.births_of) = (BTreeMap::new(), BTreeMap::new());
        for (birth, id) in called {
            self.call(birth, id);
        }
        self.given = ids.given();
    }

    /// Notes that at least `given` ids have been given, some of them to things that are no longer in the map.
    pub fn give_until(&mut self, given: u64) {
        self.given = self.given.max(given);
    }

    /// How many things ever came into the map.
    pub fn births(&self) -> u64 {
        self.births
    }

    /// How many ids have been given, from 0 on.
    pub fn given(&self) -> u64 {
        self.given
    }

    /// Bytes held, approximately.
    pub fn memory_bytes(&self) -> usize {
        2 * self.of_births.len() * size_of::<(Birth, Id)>()
    }

    fn call(&mut self, birth: Birth, id: Id) {
        if id.number() != birth.get() {
            self.of_births.insert(birth, id);
            self.births_of.insert(id, birth);
        }
    }
}

/// The part of [`Names`] that is saved.
#[cfg(feature = "serde")]
#[derive(serde::Serialize, serde::Deserialize)]
#[serde(rename = "Names")]
struct SavedNames<Id: Ord> {
    births: u64,
    given: u64,
    of_births: BTreeMap<Birth, Id>,
}

#[cfg(feature = "serde")]
impl<Id: Numbered> TryFrom<SavedNames<Id>> for Names<Id> {
    type Error = &'static str;

    fn try_from(saved: SavedNames<Id>) -> Result<Self, Self::Error> {
        let SavedNames { births, given, of_births } = saved;
        let births_of: BTreeMap<Id, Birth> = of_births.iter().map(|(&birth, &id)| (id, birth)).collect();
        // Each thing has been given an id, so that no id to come is already in use.
        let is_possible = births <= given
            && births_of.len() == of_births.len()
            && of_births.iter().all(|(birth, id)| birth.get() < births && id.number() < given);
        let names = Self { births, given, of_births, births_of };
        if is_possible { Ok(names) } else { Err("an id of a thing that does not exist, or of two things") }
    }
}

#[cfg(feature = "serde")]
impl<Id: Ord> From<Names<Id>> for SavedNames<Id> {
    fn from(names: Names<Id>) -> Self {
        Self { births: names.births, given: names.given, of_births: names.of_births }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::PlaneId;

    /// The names of things 0 to 2, where seven ids were given before: from now on thing 0 has id 1, thing 1
    /// has id 0, and thing 2 has a new id.
    fn succeeded() -> Names<PlaneId> {
        let mut names = Names::<PlaneId>::default();
        for _ in 0..3 {
            names.add();
        }
        let swapped =
            BTreeMap::from([[0, 1], [1, 0]].map(|pair| (PlaneId::new(pair[0]), PlaneId::new(pair[1]))));
        let mut ids = Succession::new(swapped, [7, 3], PlaneId::new);
        names.succeed([0, 1, 2].map(Birth::new), &mut ids);
        names
    }

    #[test]
    fn births_stay_when_ids_are_handed_down() {
        let mut names = succeeded();
        let ids = [0, 1, 2].map(|birth| names.id(Birth::new(birth)).get());
        assert_eq!(ids, [1, 0, 7]);
        for birth in [0, 1, 2].map(Birth::new) {
            assert_eq!(names.birth(names.id(birth)), Some(birth));
        }
        assert_eq!(names.birth(PlaneId::new(2)), None);
        assert_eq!(names.add(), (Birth::new(3), PlaneId::new(8)));
        assert_eq!((names.births(), names.given()), (4, 9));
    }

    #[test]
    fn what_is_gone_for_good_costs_nothing() {
        let mut names = succeeded();
        for birth in [0, 1, 2].map(Birth::new) {
            names.forget(birth);
        }
        assert_eq!(names.memory_bytes(), 0);
        assert_eq!(names.birth(PlaneId::new(7)), None);
    }

    #[cfg(feature = "serde")]
    #[test]
    fn names_of_two_things_are_not_read() {
        let names = succeeded();
        let json = serde_json::to_string(&names).unwrap();
        assert_eq!(serde_json::from_str::<Names<PlaneId>>(&json).unwrap(), names);
        for of_births in [r#"{"0": 1, "2": 1}"#, r#"{"3": 0}"#, r#"{"0": 8}"#] {
            let json = format!(r#"{{"births": 3, "given": 8, "of_births": {of_births}}}"#);
            assert!(serde_json::from_str::<Names<PlaneId>>(&json).is_err(), "{of_births}");
        }
    }

    /// The next thing would have got the id of a thing that is in the map. (Found by the fuzz target
    /// `saved_objects`.)
    #[cfg(feature = "serde")]
    #[test]
    fn fewer_ids_than_things_are_not_read() {
        let json = |given| format!(r#"{{"births": 3, "given": {given}, "of_births": {{}}}}"#);
        assert!(serde_json::from_str::<Names<PlaneId>>(&json(3)).is_ok());
        assert!(serde_json::from_str::<Names<PlaneId>>(&json(2)).is_err());
    }
}
