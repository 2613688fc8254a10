use std::collections::BTreeMap;
use std::io::Result;
use std::marker::PhantomData;
use std::ops::RangeFrom;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use super::{Extent, PageFile, Record};
use crate::Numbered;

/// Number of keys in a page.
const PAGE: u64 = 64;

/// A map from ids that mostly ascend, such as those of key frames, whose older values can go to a file.
///
/// Clones share the pages of 64 keys that neither has changed since, and most values of the other pages. A page
/// that goes to the file leaves the memory for all clones that share it. Reading a value that is in the file
/// leaves it there; changing it brings its page back.
///
/// ```
/// use dymlm_core::FrameId;
/// use dymlm_core::paging::{FiledMap, PageFile};
///
/// let mut sums: FiledMap<FrameId, Vec<u32>> = FiledMap::default();
/// (0..1000).for_each(|frame| sums.insert(FrameId::new(frame), vec![7; 100]));
/// let clone = sums.clone();
/// let file = PageFile::create_in(&std::env::temp_dir())?;
/// sums.page_out(2, &file)?;
/// assert!(clone.memory_bytes_beside(None, |sums| 4 * sums.capacity()) < 50_000);
/// assert_eq!(clone.get(FrameId::new(3)).map(|sums| sums.len()), Some(100));
/// # Ok::<(), std::io::Error>(())
/// ```
#[derive(Debug)]
pub struct FiledMap<K, V> {
    /// By number of the key / 64; no page is empty.
    pages: BTreeMap<u64, Arc<Page<V>>>,
    keys: PhantomData<K>,
}

#[derive(Debug)]
struct Page<V> {
    /// A bit for each key that has a value.
    keys: u64,
    values: Mutex<Values<V>>,
}

/// The values of a page, in the order of their keys.
#[derive(Debug)]
enum Values<V> {
    Memory(Arc<Vec<Arc<V>>>),
    /// How many bytes of the extent they take.
    Filed(Extent, u32),
}

impl<K, V> Default for FiledMap<K, V> {
    fn default() -> Self {
        Self { pages: BTreeMap::new(), keys: PhantomData }
    }
}

impl<K, V> Clone for FiledMap<K, V> {
    fn clone(&self) -> Self {
        Self { pages: self.pages.clone(), keys: PhantomData }
    }
}

impl<K: Numbered, V> FiledMap<K, V> {
    /// The keys, ascending.
    pub fn keys(&self) -> impl Iterator<Item = K> {
        self.pages.iter().flat_map(|(&number, page)| page.keys(number)).map(K::numbered)
    }

    /// The keys that a later state of the map no longer has.
    pub fn gone_from<'a>(&'a self, later: &'a Self) -> impl Iterator<Item = K> + 'a {
        let keys = self.unshared(Some(later)).flat_map(|(number, page)| page.keys(number));
        let is_gone =
            |key: &u64| later.pages.get(&(key / PAGE)).is_none_or(|page| page.place(*key).is_none());
        keys.filter(is_gone).map(K::numbered)
    }

    /// The pages that another state of the map does not share.
    fn unshared<'a>(&'a self, other: Option<&'a Self>) -> impl Iterator<Item = (u64, &'a Page<V>)> {
        let pages = self.pages.iter().filter(move |(number, page)| {
            let other = other.and_then(|other| other.pages.get(number));
            other.is_none_or(|other| !Arc::ptr_eq(page, other))
        });
        pages.map(|(&number, page)| (number, &**page))
    }

    /// Bytes of memory that another state of the map does not share, with those that the values own.
    pub fn memory_bytes_beside(&self, other: Option<&Self>, owned: impl Fn(&V) -> usize) -> usize {
        let page = |(number, page): (u64, &Page<V>)| {
            let Some(values) = page.in_memory() else { return size_of::<Page<V>>() };
            let others = other.and_then(|other| other.pages.get(&number)).and_then(|page| page.in_memory());
            let is_shared = |value: &Arc<V>| {
                others.as_ref().is_some_and(|others| others.iter().any(|other| Arc::ptr_eq(other, value)))
            };
            let own = values.iter().filter(|value| !is_shared(value));
            let own: usize = own.map(|value| 2 * size_of::<usize>() + size_of::<V>() + owned(value)).sum();
            size_of::<Page<V>>() + values.capacity() * size_of::<Arc<V>>() + own
        };
        self.pages.len() * size_of::<(u64, Arc<Page<V>>)>() + self.unshared(other).map(page).sum::<usize>()
    }
}

impl<K: Numbered, V: Record + Clone> FiledMap<K, V> {
    /// The value of a key.
    pub fn get(&self, key: K) -> Option<Arc<V>> {
        let key = key.number();
        let page = self.pages.get(&(key / PAGE))?;
        page.values().get(page.place(key)?).map(Arc::clone)
    }

    /// Keys and values in the order of the keys, one page after the other.
    pub fn iter(&self) -> impl Iterator<Item = (K, Arc<V>)> {
        self.range(K::numbered(0)..)
    }

    /// The values in the order of their keys.
    pub fn values(&self) -> impl Iterator<Item = Arc<V>> {
        self.iter().map(|(_, value)| value)
    }

    /// Keys and values from a key on.
    pub fn range(&self, keys: RangeFrom<K>) -> impl Iterator<Item = (K, Arc<V>)> {
        let pages = self.pages.range(keys.start.number() / PAGE..);
        let entries = pages.flat_map(|(&number, page)| page.entries(number));
        let entries = entries.map(|(key, value)| (K::numbered(key), value));
        entries.filter(move |(key, _)| keys.contains(key))
    }

    /// Keys and values that are new or changed since an earlier state of the map, and some others of pages that
    /// have come back from the file.
    pub fn changed_since<'a>(&'a self, earlier: &'a Self) -> impl Iterator<Item = (K, Arc<V>)> + 'a {
        let changed = self.unshared(Some(earlier)).flat_map(|(number, page)| {
            let before = earlier.pages.get(&number).map_or_else(Vec::new, |page| page.entries(number));
            let before: BTreeMap<u64, Arc<V>> = before.into_iter().collect();
            let is_same = move |(key, value): &(u64, Arc<V>)| {
                before.get(key).is_some_and(|before| Arc::ptr_eq(before, value))
            };
            page.entries(number).into_iter().filter(move |entry| !is_same(entry))
        });
        changed.map(|(key, value)| (K::numbered(key), value))
    }

    /// Sets the value of a key.
    pub fn insert(&mut self, key: K, value: V) {
        let key = key.number();
        self.change(key / PAGE, |page| {
            if let Some(place) = page.place(key) {
                page.values[place] = Arc::new(value);
            } else {
                page.keys |= bit(key);
                page.values.insert(rank(page.keys, key), Arc::new(value));
            }
        });
    }

    /// Removes a key; returns its value.
    pub fn remove(&mut self, key: K) -> Option<Arc<V>> {
        let key = key.number();
        let place = self.pages.get(&(key / PAGE))?.place(key)?;
        self.change(key / PAGE, |page| {
            page.keys &= !bit(key);
            (place < page.values.len()).then(|| page.values.remove(place))
        })
    }

    /// Changes the value of a key, if it has one.
    pub fn update(&mut self, key: K, change: impl FnOnce(&mut V)) {
        let key = key.number();
        if self.pages.contains_key(&(key / PAGE)) {
            self.change(key / PAGE, |page| {
                let place = page.place(key);
                if let Some(value) = place.and_then(|place| page.values.get_mut(place)) {
                    change(Arc::make_mut(value));
                }
            });
        }
    }

    /// Replaces the values for which `renew` gives another one. It is called once for each, in the order of the
    /// keys.
    pub fn renew(&mut self, mut renew: impl FnMut(&V) -> Option<V>) {
        let numbers: Vec<u64> = self.pages.keys().copied().collect();
        for number in numbers {
            let values = self.pages.get(&number).map_or_else(Arc::default, |page| page.values());
            let renewed: Vec<Option<V>> = values.iter().map(|value| renew(value)).collect();
            if renewed.iter().any(Option::is_some) {
                self.change(number, |page| {
                    for (value, renewed) in page.values.iter_mut().zip(renewed) {
                        if let Some(renewed) = renewed {
                            *value = Arc::new(renewed);
                        }
                    }
                });
            }
        }
    }

    /// Removes the values that are not kept.
    pub fn retain(&mut self, is_kept: impl Fn(&V) -> bool) {
        let goes = |(key, value): (K, Arc<V>)| (!is_kept(&value)).then_some(key);
        let gone: Vec<K> = self.iter().filter_map(goes).collect();
        for key in gone {
            self.remove(key);
        }
    }

    /// Puts all pages but the newest ones into a file.
    ///
    /// # Errors
    ///
    /// Those of writing; then pages stay in memory.
    pub fn page_out(&self, newest: usize, file: &Arc<PageFile>) -> Result<()> {
        let older = self.pages.len().saturating_sub(newest);
        self.pages.values().take(older).try_for_each(|page| page.page_out(file))
    }

    /// Changes a page, which is made if there is none and dropped if it has become empty.
    fn change<R>(&mut self, number: u64, change: impl FnOnce(&mut OpenPage<V>) -> R) -> R {
        let page = self.pages.remove(&number);
        let mut page = page.map_or_else(OpenPage::default, OpenPage::of);
        let result = change(&mut page);
        if page.keys != 0 {
            self.pages.insert(number, Arc::new(page.closed()));
        }
        result
    }
}

/// A page that is being changed.
struct OpenPage<V> {
    keys: u64,
    values: Vec<Arc<V>>,
}

impl<V> Default for OpenPage<V> {
    fn default() -> Self {
        Self { keys: 0, values: Vec::new() }
    }
}

impl<V> OpenPage<V> {
    fn place(&self, key: u64) -> Option<usize> {
        place(self.keys, key)
    }

    fn closed(self) -> Page<V> {
        Page { keys: self.keys, values: Mutex::new(Values::Memory(Arc::new(self.values))) }
    }
}

impl<V: Record + Clone> OpenPage<V> {
    fn of(page: Arc<Page<V>>) -> Self {
        let keys = page.keys;
        // Values of a page that no clone shares are not shared with the page either.
        let values = match Arc::try_unwrap(page) {
            Ok(page) => page.into_values(),
            Err(page) => page.values(),
        };
        let values = Arc::unwrap_or_clone(values);
        // If the file could not be read, the keys have no values any more.
        Self { keys: if values.is_empty() { 0 } else { keys }, values }
    }
}

impl<V> Page<V> {
    fn keys(&self, number: u64) -> impl Iterator<Item = u64> + use<V> {
        let keys = self.keys;
        (number * PAGE..=number * PAGE + (PAGE - 1)).filter(move |key| keys & bit(*key) != 0)
    }

    fn place(&self, key: u64) -> Option<usize> {
        place(self.keys, key)
    }

    fn in_memory(&self) -> Option<Arc<Vec<Arc<V>>>> {
        match &*self.locked() {
            Values::Memory(values) => Some(Arc::clone(values)),
            Values::Filed(..) => None,
        }
    }

    fn locked(&self) -> MutexGuard<'_, Values<V>> {
        // A panic leaves the values as they were.
        self.values.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<V: Record> Page<V> {
    /// The values. They are missing if the file cannot be read: see [`PageFile::failure`].
    fn values(&self) -> Arc<Vec<Arc<V>>> {
        self.locked().read()
    }

    fn into_values(self) -> Arc<Vec<Arc<V>>> {
        match self.values.into_inner().unwrap_or_else(PoisonError::into_inner) {
            Values::Memory(values) => values,
            filed @ Values::Filed(..) => filed.read(),
        }
    }

    fn entries(&self, number: u64) -> Vec<(u64, Arc<V>)> {
        self.keys(number).zip(self.values().iter().map(Arc::clone)).collect()
    }

    fn page_out(&self, file: &Arc<PageFile>) -> Result<()> {
        let mut values = self.locked();
        if let Values::Memory(in_memory) = &*values {
            let mut bytes = Vec::new();
            in_memory.write(&mut bytes);
            let length = bytes.len() as u32;
            *values = Values::Filed(file.write(&mut bytes)?, length);
        }
        Ok(())
    }
}

impl<V: Record> Values<V> {
    fn read(&self) -> Arc<Vec<Arc<V>>> {
        match self {
            Self::Memory(values) => Arc::clone(values),
            Self::Filed(extent, length) => Arc::new(extent.read(0, *length)),
        }
    }
}

/// The bit of a key in its page.
fn bit(key: u64) -> u64 {
    1 << (key % PAGE)
}

/// The number of keys of a page that are smaller than a key.
fn rank(keys: u64, key: u64) -> usize {
    (keys & (bit(key) - 1)).count_ones() as usize
}

/// The place of a key's value among those of its page, if it has one.
fn place(keys: u64, key: u64) -> Option<usize> {
    (keys & bit(key) != 0).then(|| rank(keys, key))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FrameId;

    type Map = FiledMap<FrameId, Vec<u32>>;

    fn id(number: u64) -> FrameId {
        FrameId::new(number)
    }

    fn file() -> Arc<PageFile> {
        PageFile::create_in(&std::env::temp_dir()).unwrap()
    }

    fn map(keys: impl IntoIterator<Item = u64>) -> Map {
        let mut map = Map::default();
        keys.into_iter().for_each(|key| map.insert(id(key), vec![key as u32; 50]));
        map
    }

    fn bytes(map: &Map) -> usize {
        map.memory_bytes_beside(None, |value| 4 * value.capacity())
    }

    #[test]
    fn it_is_the_same_in_the_file_as_in_memory() {
        let keys = || (0..700).filter(|key| key % 7 != 3);
        let (filed, file) = (map(keys()), file());
        let (whole, shared) = (map(keys()), filed.clone());
        filed.page_out(2, &file).unwrap();
        assert!(bytes(&filed) < bytes(&whole) / 3 && bytes(&shared) == bytes(&filed));
        for other in [&filed, &shared] {
            assert!(other.iter().eq(whole.iter()) && other.keys().eq(keys().map(id)));
            assert!(other.range(id(450)..).eq(whole.range(id(450)..)) && other.values().eq(whole.values()));
            assert!((0..800).all(|key| other.get(id(key)) == whole.get(id(key))));
        }
        assert!(file.failure().is_none());
    }

    #[test]
    fn changes_are_those_of_a_map_in_memory_and_leave_clones_alone() {
        let change = |map: &mut Map| {
            map.update(id(70), |value| value.push(1));
            map.insert(id(1000), vec![2]);
            map.insert(id(69), vec![3]);
            let removed = map.remove(id(128));
            map.renew(|value| (value[0] % 100 == 5).then(Vec::new));
            map.retain(|value| !matches!(value.first(), Some(192..=300)));
            removed
        };
        let (mut filed, mut whole) = (map(0..400), map(0..400));
        filed.page_out(0, &file()).unwrap();
        let before = filed.clone();
        assert_eq!(change(&mut filed), change(&mut whole));
        assert!(filed.iter().eq(whole.iter()) && filed.keys().eq(whole.keys()));
        assert!(before.iter().eq(map(0..400).iter()));
        let gone = [128].into_iter().chain((192..=300).filter(|key| key % 100 != 5));
        assert!(before.gone_from(&filed).eq(gone.map(id)));
    }

    #[test]
    fn what_has_changed_is_found_whether_it_is_filed_or_not() {
        let mut map = map(0..200);
        let earlier = map.clone();
        map.page_out(1, &file()).unwrap();
        map.insert(id(200), vec![1]);
        map.update(id(199), |value| value.push(7));
        assert!(map.changed_since(&earlier).map(|(key, _)| key).eq([199, 200].map(id)));
        map.update(id(3), |value| value.push(7));
        assert!(map.changed_since(&earlier).any(|(key, value)| key == id(3) && value.len() == 51));
    }

    #[test]
    fn values_that_cannot_be_read_are_missing() {
        let (map, file) = (map(0..100), file());
        map.page_out(0, &file).unwrap();
        let mut damaged = file.write(&mut vec![255; 8]).unwrap();
        for page in map.pages.values() {
            if let Values::Filed(extent, _) = &mut *page.locked() {
                std::mem::swap(extent, &mut damaged);
            }
        }
        assert!(map.get(id(3)).is_none() && file.failure().is_some());
    }
}
