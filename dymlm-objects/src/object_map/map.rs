use std::sync::Arc;

use dymlm_core::{Birth, MergedIds, Names, ObjectId};

use super::{MapObject, ObjectState, SpaceIndex};

/// The objects of the static world.
///
/// Length, iteration and all queries mean confirmed objects; [`candidates`](Self::candidates) are the others.
/// An id is never used again: of two merged objects the one with more observations keeps its id, and the id
/// of the other leads to it.
#[derive(Debug, Clone)]
pub struct ObjectMap {
    /// Sorted by birth; clones of the map share the objects that neither has changed since.
    pub(crate) objects: Vec<Arc<MapObject>>,
    /// Spatial index of the objects.
    pub(crate) index: SpaceIndex,
    pub(crate) names: Names<ObjectId>,
    /// For each merged object, the object into which it was merged.
    pub(crate) absorbed_by: MergedIds<ObjectId>,
}

impl ObjectMap {
    /// An empty map, for a camera with a range of `range` metres.
    pub(crate) fn new(range: f64) -> Self {
        let index = SpaceIndex::new(range);
        Self { objects: Vec::new(), index, names: Names::default(), absorbed_by: MergedIds::default() }
    }

    /// The confirmed objects, in the order in which they came into the map.
    pub fn objects(&self) -> impl Iterator<Item = &MapObject> {
        self.all().filter(|object| object.state == ObjectState::Confirmed)
    }

    /// The tentative objects, in the same order: seen too seldom, of an implausible size, hardly shown by any
    /// view, or no longer confirmed.
    pub fn candidates(&self) -> impl Iterator<Item = &MapObject> {
        self.all().filter(|object| object.state == ObjectState::Tentative)
    }

    /// The object of an id, confirmed or not; for a merged object, the one into which it was merged. `None`
    /// once it was removed.
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

    /// Approximate size of the map in bytes, including what clones share.
    pub fn memory_bytes(&self) -> usize {
        self.own_bytes(|_| None)
    }

    /// Approximate bytes that the map does not share with another state of it. O(objects).
    pub fn memory_bytes_beside(&self, other: &Self) -> usize {
        self.own_bytes(|birth| other.objects.get(other.place(birth)?))
    }

    fn own_bytes<'a>(&self, other: impl Fn(Birth) -> Option<&'a Arc<MapObject>>) -> usize {
        let object = |own: &Arc<MapObject>| match other(own.birth) {
            Some(other) if Arc::ptr_eq(own, other) => 0,
            other => own.memory_bytes_beside(other.map(Arc::as_ref)),
        };
        let objects: usize = self.objects.iter().map(object).sum();
        objects + self.absorbed_by.memory_bytes() + self.names.memory_bytes()
    }

    /// The present id of an object: its own, or that of the object into which it was merged.
    pub fn current_id(&self, id: ObjectId) -> ObjectId {
        self.absorbed_by.current(id)
    }

    /// All objects, in the order of their births.
    pub(crate) fn all(&self) -> impl Iterator<Item = &MapObject> {
        self.objects.iter().map(Arc::as_ref)
    }

    /// The confirmed ones of some objects.
    pub(crate) fn confirmed(&self, births: &[Birth]) -> impl Iterator<Item = &MapObject> {
        let objects = births.iter().filter_map(|&birth| self.born(birth));
        objects.filter(|object| object.state == ObjectState::Confirmed)
    }

    /// The object of a birth.
    pub(crate) fn born(&self, birth: Birth) -> Option<&MapObject> {
        self.place(birth).and_then(|place| self.objects.get(place)).map(Arc::as_ref)
    }

    /// The same, to change it; clones of the map keep it as it is.
    pub(crate) fn born_mut(&mut self, birth: Birth) -> Option<&mut MapObject> {
        let place = self.place(birth)?;
        self.objects.get_mut(place).map(Arc::make_mut)
    }

    pub(crate) fn place(&self, birth: Birth) -> Option<usize> {
        self.objects.binary_search_by_key(&birth, |object| object.birth).ok()
    }

    /// Removes an object and returns it. Others forget that they were seen beside it.
    pub(crate) fn remove(&mut self, birth: Birth) -> Option<Arc<MapObject>> {
        let removed = self.take(birth)?;
        for neighbour in removed.seen_apart.neighbours() {
            if let Some(neighbour) = self.born_mut(neighbour) {
                neighbour.seen_apart.forget(birth);
            }
        }
        Some(removed)
    }

    /// Takes an object that is merged into another out of the map.
    pub(crate) fn take(&mut self, birth: Birth) -> Option<Arc<MapObject>> {
        let place = self.place(birth)?;
        self.index.remove(birth);
        self.names.forget(birth);
        Some(self.objects.remove(place))
    }
}
