use std::ops::Index;
use std::sync::Arc;

/// A list whose clones share the pages that neither has changed since, so that a clone costs one pointer per
/// 64 items.
///
/// ```
/// use dymlm_core::Pages;
///
/// let mut poses: Pages<[f64; 3]> = (0..1000).map(|step| [0.1 * f64::from(step), 0.0, 0.0]).collect();
/// let earlier = poses.clone();
/// poses.push([100.0, 0.0, 0.0]);
/// assert_eq!((earlier.len(), poses.len()), (1000, 1001));
/// assert_eq!(poses.unshared(&earlier).count(), 1001 - 15 * 64);
/// ```
#[derive(Debug, Clone)]
pub struct Pages<T> {
    full: Vec<Arc<[T; PAGE]>>,
    /// The items after the last full page, fewer than a page holds.
    rest: Vec<T>,
}

impl<T> Default for Pages<T> {
    fn default() -> Self {
        Self { full: Vec::new(), rest: Vec::new() }
    }
}

/// [`Pages::PAGE`].
const PAGE: usize = 64;

impl<T> Pages<T> {
    /// Number of items in a page.
    pub const PAGE: usize = PAGE;

    /// Number of items.
    #[inline]
    pub fn len(&self) -> usize {
        self.full.len() * PAGE + self.rest.len()
    }

    /// Whether there is no item.
    #[inline]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// An item by its index.
    #[inline]
    pub fn get(&self, index: usize) -> Option<&T> {
        match self.full.get(index / PAGE) {
            Some(page) => Some(&page[index % PAGE]),
            None => self.rest.get(index - self.full.len() * PAGE),
        }
    }

    /// The indices of the items that this list does not share with another.
    pub fn unshared<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = usize> + 'a {
        self.unshared_pages(other).flat_map(|(page, items)| page * PAGE..page * PAGE + items.len())
    }

    /// The pages that this list does not share with another, with their numbers.
    pub fn unshared_pages<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = (usize, &'a [T])> + 'a {
        let is_shared = |page: usize| {
            let pages = self.full.get(page).zip(other.full.get(page));
            pages.is_some_and(|(own, other)| Arc::ptr_eq(own, other))
        };
        self.pages().enumerate().filter(move |(page, _)| !is_shared(*page))
    }

    /// The items, by pages of 64; the last may be shorter.
    pub fn pages(&self) -> impl Iterator<Item = &[T]> {
        let rest = (!self.rest.is_empty()).then_some(self.rest.as_slice());
        self.full.iter().map(|page| page.as_slice()).chain(rest)
    }

    /// The items.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &T> {
        self.full.iter().flat_map(|page| page.iter()).chain(&self.rest)
    }

    /// The items from an index on.
    pub fn iter_from(&self, index: usize) -> impl Iterator<Item = &T> {
        self.pages().skip(index / PAGE).flatten().skip(index % PAGE)
    }

    /// The last item.
    pub fn last(&self) -> Option<&T> {
        self.rest.last().or_else(|| self.full.last()?.last())
    }

    /// Adds an item at the end.
    pub fn push(&mut self, item: T) {
        self.rest.push(item);
        if self.rest.len() == PAGE {
            match <[T; PAGE]>::try_from(std::mem::take(&mut self.rest)) {
                Ok(page) => self.full.push(Arc::new(page)),
                Err(rest) => self.rest = rest,
            }
        }
    }

    /// Bytes held, without what the items own. O(1).
    pub fn memory_bytes(&self) -> usize {
        self.bytes_with(self.full.len())
    }

    /// Bytes held that another list does not share, without what the items own.
    pub fn memory_bytes_beside(&self, other: &Self) -> usize {
        self.bytes_with(self.unshared_pages(other).filter(|(page, _)| *page < self.full.len()).count())
    }

    /// Bytes held, with so many of the full pages.
    fn bytes_with(&self, own: usize) -> usize {
        let page = size_of::<[T; PAGE]>() + 2 * size_of::<usize>();
        self.full.capacity() * size_of::<Arc<[T; PAGE]>>()
            + own * page
            + self.rest.capacity() * size_of::<T>()
    }
}

impl<T: Clone> Pages<T> {
    /// The first `len` items; full pages are shared with this list.
    #[must_use]
    pub fn first(&self, len: usize) -> Self {
        let full: Vec<_> = self.full.iter().take(len / PAGE).map(Arc::clone).collect();
        let rest = self.pages().nth(full.len()).unwrap_or_default();
        let rest = rest.iter().take(len - full.len() * PAGE).cloned().collect();
        Self { full, rest }
    }

    /// An item to be changed; its page is copied first if a clone shares it.
    #[inline]
    pub fn get_mut(&mut self, index: usize) -> Option<&mut T> {
        let rest = self.full.len() * PAGE;
        match self.full.get_mut(index / PAGE) {
            Some(page) => Some(&mut Arc::make_mut(page)[index % PAGE]),
            None => self.rest.get_mut(index - rest),
        }
    }

    /// Replaces an item; nothing happens when there is none at the index.
    pub fn set(&mut self, index: usize, item: T) {
        if let Some(place) = self.get_mut(index) {
            *place = item;
        }
    }

    /// Replaces an item by one that may be equal: then its page stays shared.
    pub fn update(&mut self, index: usize, item: T)
    where
        T: PartialEq,
    {
        if self.get(index).is_some_and(|held| *held != item) {
            self.set(index, item);
        }
    }

    /// All items, to be changed; pages are copied as by [`get_mut`](Self::get_mut).
    pub fn iter_mut(&mut self) -> impl Iterator<Item = &mut T> {
        self.full.iter_mut().flat_map(|page| Arc::make_mut(page).iter_mut()).chain(&mut self.rest)
    }

    /// Grows the list to `len` items, with new ones at the end.
    pub fn grow(&mut self, len: usize, mut new: impl FnMut() -> T) {
        while self.len() < len {
            self.push(new());
        }
    }

    /// Keeps the items for which `stays` is true, in their order.
    pub fn keep(&mut self, stays: &[bool]) {
        let kept = self.iter().zip(stays).filter(|(_, stays)| **stays).map(|(item, _)| item.clone());
        *self = kept.collect();
    }
}

impl<T> FromIterator<T> for Pages<T> {
    fn from_iter<I: IntoIterator<Item = T>>(items: I) -> Self {
        let mut pages = Self::default();
        for item in items {
            pages.push(item);
        }
        pages
    }
}

impl<T> Index<usize> for Pages<T> {
    type Output = T;

    /// As for a slice: for an index that is known to be in range.
    #[inline]
    fn index(&self, index: usize) -> &T {
        match self.full.get(index / PAGE) {
            Some(page) => &page[index % PAGE],
            None => &self.rest[index - self.full.len() * PAGE],
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_clone_stays_as_it_was_and_shares_what_has_not_changed() {
        let mut pages: Pages<usize> = (0..200).collect();
        let clone = pages.clone();
        *pages.get_mut(70).unwrap() = 7;
        *pages.get_mut(199).unwrap() = 8;
        pages.push(200);
        assert!(clone.iter().copied().eq(0..200) && clone.len() == 200 && clone.get(200).is_none());
        assert_eq!((pages[70], pages[199], pages[200], pages.len()), (7, 8, 200, 201));
        let shared: Vec<bool> = pages.full.iter().zip(&clone.full).map(|(a, b)| Arc::ptr_eq(a, b)).collect();
        assert_eq!(shared, [true, false, true]);
        assert!(pages.unshared(&clone).eq((64..128).chain(192..201)));
        let shared = pages.memory_bytes() - pages.memory_bytes_beside(&clone);
        assert_eq!(shared, 2 * (PAGE + 2) * size_of::<usize>());
    }

    #[test]
    fn what_is_replaced_by_the_same_stays_shared() {
        let mut pages: Pages<usize> = (0..200).collect();
        let clone = pages.clone();
        (0..250).for_each(|index| pages.update(index, index));
        assert_eq!(pages.unshared(&clone).count(), 200 % PAGE);
        pages.update(70, 7);
        assert_eq!((pages[70], pages.len(), pages.unshared(&clone).count()), (7, 200, PAGE + 200 % PAGE));
    }

    #[test]
    fn the_first_items_share_their_pages() {
        let pages: Pages<usize> = (0..200).collect();
        for len in [0, 1, 63, 64, 65, 128, 200, 1000] {
            let first = pages.first(len);
            assert!(first.iter().copied().eq(0..len.min(200)), "{len}");
            assert!(first.unshared(&pages).count() < PAGE);
            assert!(pages.iter_from(len).copied().eq(len..200));
        }
    }

    #[test]
    fn it_grows_and_keeps_what_stays() {
        let mut pages: Pages<u32> = Pages::default();
        pages.grow(130, || 5);
        pages.iter_mut().zip(0..).for_each(|(item, index)| *item = index);
        let stays: Vec<bool> = (0..130).map(|index| index % 2 == 1).collect();
        pages.keep(&stays);
        assert!(pages.iter().copied().eq((0..65).map(|half| 2 * half + 1)));
    }
}
