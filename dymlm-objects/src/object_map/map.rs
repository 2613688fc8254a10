use std::collections::BTreeMap;

use super::{MapObject, ObjectState};

/// The objects of the static world.
///
/// Ids are given once and never again; a merged object keeps the id of the one with more observations.
#[derive(Debug, Clone, Default)]
pub struct ObjectMap {
    /// By ascending id.
    pub(crate) objects: Vec<MapObject>,
    pub(crate) next_id: u64,
    /// Frames in which two objects close to each other were both detected, by ids in ascending order.
    pub(crate) together: BTreeMap<(u64, u64), u32>,
}

impl ObjectMap {
    /// The objects that are believed, by ascending id.
    pub fn objects(&self) -> impl Iterator<Item = &MapObject> {
        self.objects.iter().filter(|object| object.state == ObjectState::Confirmed)
    }

    /// All objects, also those seen too seldom to be believed, by ascending id.
    pub fn all_objects(&self) -> &[MapObject] {
        &self.objects
    }

    /// The object of an id.
    pub fn object(&self, id: u64) -> Option<&MapObject> {
        self.place(id).and_then(|place| self.objects.get(place))
    }

    /// Number of objects that are believed.
    pub fn len(&self) -> usize {
        self.objects().count()
    }

    /// Whether no object is believed.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    pub(crate) fn place(&self, id: u64) -> Option<usize> {
        self.objects.binary_search_by_key(&id, |object| object.id).ok()
    }
}

impl ObjectMap {
    /// Takes an object out.
    pub(crate) fn remove(&mut self, id: u64) -> Option<MapObject> {
        let place = self.place(id)?;
        self.together.retain(|&(one, other), _| one != id && other != id);
        Some(self.objects.remove(place))
    }
}
