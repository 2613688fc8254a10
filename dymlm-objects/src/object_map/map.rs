use std::sync::Arc;

use dymlm_core::{MergedIds, ObjectId};

use super::{MapObject, ObjectState, SpaceIndex};

/// The objects of the static world.
///
/// Its length, its iteration and all its queries mean objects that are confirmed;
/// [`candidates`](Self::candidates) are those seen too seldom. Ids are given once and never again: of two
/// merged objects the one with more observations keeps its id, and the other's leads to it.
#[derive(Debug, Clone)]
pub struct ObjectMap {
    /// By ascending id; clones share those that neither has changed since.
    pub(crate) objects: Vec<Arc<MapObject>>,
    /// Where they are.
    pub(crate) index: SpaceIndex,
    pub(crate) next_id: u64,
    /// What merged objects went into.
    pub(crate) absorbed_by: MergedIds<ObjectId>,
}

impl ObjectMap {
    /// An empty map, made for a camera that sees as far as `range` metres.
    pub(crate) fn new(range: f64) -> Self {
        let index = SpaceIndex::new(range);
        Self { objects: Vec::new(), index, next_id: 0, absorbed_by: MergedIds::default() }
    }

    /// The confirmed objects, by ascending id.
    pub fn objects(&self) -> impl Iterator<Item = &MapObject> {
        self.all().filter(|object| object.state == ObjectState::Confirmed)
    }

    /// The objects that are not confirmed, by ascending id: seen too seldom, or not any more.
    pub fn candidates(&self) -> impl Iterator<Item = &MapObject> {
        self.all().filter(|object| object.state == ObjectState::Tentative)
    }

    /// The object of an id, confirmed or not; of a merged object the one that it went into. `None` once it
    /// was removed.
    pub fn object(&self, id: ObjectId) -> Option<&MapObject> {
        self.place(self.current_id(id)).and_then(|place| self.objects.get(place)).map(Arc::as_ref)
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
        objects + self.absorbed_by.memory_bytes()
    }

    /// The id of what an object is now: its own, or that of the object which it went into.
    pub fn current_id(&self, id: ObjectId) -> ObjectId {
        self.absorbed_by.current(id)
    }

    /// All objects, by ascending id.
    pub(crate) fn all(&self) -> impl Iterator<Item = &MapObject> {
        self.objects.iter().map(Arc::as_ref)
    }

    pub(crate) fn place(&self, id: ObjectId) -> Option<usize> {
        self.objects.binary_search_by_key(&id, |object| object.id).ok()
    }

    /// Takes an object out.
    pub(crate) fn remove(&mut self, id: ObjectId) -> Option<Arc<MapObject>> {
        let place = self.place(id)?;
        Some(self.objects.remove(place))
    }

    /// Takes an object out that goes into another: its id leads there from now on.
    pub(crate) fn absorb(&mut self, removed: ObjectId, kept: ObjectId) -> Option<Arc<MapObject>> {
        let object = self.remove(removed)?;
        self.absorbed_by.insert(removed, kept);
        Some(object)
    }
}
