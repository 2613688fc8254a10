use std::collections::{BTreeMap, btree_map};
use std::ops::RangeBounds;
use std::sync::Arc;

/// A map whose clones share its values: a clone costs one pointer per value, and a shared value is copied
/// when it is changed. A value borrowed mutably counts as changed.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct SharedMap<K, V>(BTreeMap<K, Arc<V>>);

impl<K, V> Default for SharedMap<K, V> {
    fn default() -> Self {
        Self(BTreeMap::new())
    }
}

impl<K: Ord, V: Clone> SharedMap<K, V> {
    pub(crate) fn len(&self) -> usize {
        self.0.len()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    pub(crate) fn contains_key(&self, key: &K) -> bool {
        self.0.contains_key(key)
    }

    pub(crate) fn get(&self, key: &K) -> Option<&V> {
        self.0.get(key).map(Arc::as_ref)
    }

    pub(crate) fn get_mut(&mut self, key: &K) -> Option<&mut V> {
        self.0.get_mut(key).map(Arc::make_mut)
    }

    /// The value of a key; inserted when there is none.
    pub(crate) fn get_or_insert_with(&mut self, key: K, new: impl FnOnce() -> V) -> &mut V {
        Arc::make_mut(self.0.entry(key).or_insert_with(|| Arc::new(new())))
    }

    pub(crate) fn insert(&mut self, key: K, value: V) {
        self.0.insert(key, Arc::new(value));
    }

    pub(crate) fn remove(&mut self, key: &K) -> Option<V> {
        self.0.remove(key).map(Arc::unwrap_or_clone)
    }

    pub(crate) fn keys(&self) -> impl Iterator<Item = &K> {
        self.0.keys()
    }

    pub(crate) fn values(&self) -> impl Iterator<Item = &V> {
        self.0.values().map(Arc::as_ref)
    }

    #[cfg(feature = "state")]
    pub(crate) fn values_mut(&mut self) -> impl Iterator<Item = &mut V> {
        self.0.values_mut().map(Arc::make_mut)
    }

    pub(crate) fn iter(&self) -> impl Iterator<Item = (&K, &V)> {
        self.0.iter().map(|(key, value)| (key, value.as_ref()))
    }

    /// The entries with keys in a range, in order.
    pub(crate) fn range(&self, keys: impl RangeBounds<K>) -> impl Iterator<Item = (&K, &V)> {
        let held: btree_map::Range<'_, K, Arc<V>> = self.0.range(keys);
        held.map(|(key, value)| (key, value.as_ref()))
    }

    /// The entries that are new or changed since an earlier state.
    #[cfg(feature = "state")]
    pub(crate) fn changed_since<'a>(&'a self, earlier: &'a Self) -> impl Iterator<Item = (&'a K, &'a V)> {
        let is_same =
            |key: &K, value: &Arc<V>| earlier.0.get(key).is_some_and(|before| Arc::ptr_eq(before, value));
        let changed = self.0.iter().filter(move |(key, value)| !is_same(key, value));
        changed.map(|(key, value)| (key, value.as_ref()))
    }

    /// The keys that a later state no longer has.
    #[cfg(feature = "state")]
    pub(crate) fn gone_from<'a>(&'a self, later: &'a Self) -> impl Iterator<Item = &'a K> {
        self.0.keys().filter(|key| !later.0.contains_key(key))
    }

    /// Size in bytes of the map and of the values that another map does not share; `owned` gives what a value
    /// owns beside the other map's value.
    pub(crate) fn memory_bytes_beside(
        &self,
        other: Option<&Self>,
        owned: impl Fn(&V, Option<&V>) -> usize,
    ) -> usize {
        let mut others = other.into_iter().flat_map(|other| &other.0).peekable();
        let value = |(key, value): (&K, &Arc<V>)| {
            // Both are in the order of their keys.
            while others.next_if(|(other, _)| *other < key).is_some() {}
            let other = others.peek().filter(|(other, _)| *other == key).map(|(_, other)| *other);
            match other {
                Some(other) if Arc::ptr_eq(other, value) => 0,
                _ => 2 * size_of::<usize>() + size_of::<V>() + owned(value, other.map(Arc::as_ref)),
            }
        };
        self.len() * size_of::<(K, Arc<V>)>() + self.0.iter().map(value).sum::<usize>()
    }
}

impl<K: Ord, V> FromIterator<(K, V)> for SharedMap<K, V> {
    fn from_iter<I: IntoIterator<Item = (K, V)>>(items: I) -> Self {
        Self(items.into_iter().map(|(key, value)| (key, Arc::new(value))).collect())
    }
}
