use std::sync::Arc;

use dymlm_core::{Birth, MergedIds, Names, ObjectId};

use super::{MapObject, ObjectState, SpaceIndex};

/// The objects of the static world.
///
/// Its length, its iteration and all its queries mean objects that are confirmed;
/// [`candidates`](Self::candidates) are those seen too seldom. Ids are given once and never again: of two
/// merged objects the one with more observations keeps its id, and the other's leads to it.
#[derive(Debug, Clone)]
pub struct ObjectMap {
    /// By their births; clones share those that neither has changed since.
    pub(crate) objects: Vec<Arc<MapObject>>,
    /// Where they are.
    pub(crate) index: SpaceIndex,
    pub(crate) names: Names<ObjectId>,
    /// What merged objects went into.
    pub(crate) absorbed_by: MergedIds<ObjectId>,
}

impl ObjectMap {
    /// An empty map, made for a camera that sees as far as `range` metres.
    pub(crate) fn new(range: f64) -> Self {
        let index = SpaceIndex::new(range);
        Self { objects: Vec::new(), index, names: Names::default(), absorbed_by: MergedIds::default() }
    }

    /// The confirmed objects, in the order in which they came into the map.
    pub fn objects(&self) -> impl Iterator<Item = &MapObject> {
        self.all().filter(|object| object.state == ObjectState::Confirmed)
    }

    /// The objects that are not confirmed, in the same order: seen too seldom, or not any more.
    pub fn candidates(&self) -> impl Iterator<Item = &MapObject> {
        self.all().filter(|object| object.state == ObjectState::Tentative)
    }

    /// The object of an id, confirmed or not; of a merged object the one that it went into. `None` once it
    /// was removed.
    pub fn object(&self, id: ObjectId) -> Option<&MapObject> {
        self.born(self.names.birth(self.current_id(id))?)
    }

    /// Number of confirmed objects.
    pub fn len(&self) -> usize {
        self.objects().count()
    }

    /// Whether no object is confirmed.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes that the map holds, about, with what clones share.
    pub fn memory_bytes(&self) -> usize {
        let objects: usize = self.all().map(MapObject::memory_bytes).sum();
        objects + self.absorbed_by.memory_bytes() + self.names.memory_bytes()
    }

    /// The id of what an object is now: its own, or that of the object which it went into.
    pub fn current_id(&self, id: ObjectId) -> ObjectId {
        self.absorbed_by.current(id)
    }

    /// All objects, in the order of their births.
    pub(crate) fn all(&self) -> impl Iterator<Item = &MapObject> {
        self.objects.iter().map(Arc::as_ref)
    }

    /// The object of a birth.
    pub(crate) fn born(&self, birth: Birth) -> Option<&MapObject> {
        self.place(birth).and_then(|place| self.objects.get(place)).map(Arc::as_ref)
    }

    pub(crate) fn place(&self, birth: Birth) -> Option<usize> {
        self.objects.binary_search_by_key(&birth, |object| object.birth).ok()
    }

    /// Takes an object out.
    pub(crate) fn remove(&mut self, birth: Birth) -> Option<Arc<MapObject>> {
        let place = self.place(birth)?;
        self.index.remove(birth);
        self.names.forget(birth);
        Some(self.objects.remove(place))
    }
}
