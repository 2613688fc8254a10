/// Most of the caller's map points that an object keeps: 32 kB, what the frames of the last minutes show on
/// it.
const MOST: usize = 4096;

/// Ids of the caller's map points on an object, those sighted last at the end.
///
/// A SLAM replaces its points for as long as it runs, so that those sighted longest ago make room: an object
/// that kept its first ones would share none with any later frame.
#[derive(Debug, Clone, Default)]
#[cfg_attr(feature = "state", derive(serde::Serialize, serde::Deserialize))]
pub(crate) struct SightedPoints {
    ids: Vec<u64>,
}

impl SightedPoints {
    /// Adds the points of an observation, ascending. O(points log points of the observation).
    pub(crate) fn add(&mut self, newest: &[u64]) {
        if !newest.is_empty() {
            self.ids.retain(|id| newest.binary_search(id).is_err());
            self.put_last(newest);
        }
    }

    /// Adds those of a duplicate, which was last seen later or earlier than the object.
    pub(crate) fn merge(&mut self, other: &Self, is_later: bool) {
        let (mut older, newer) = if is_later { (self.clone(), other) } else { (other.clone(), &*self) };
        let mut ascending = newer.ids.clone();
        ascending.sort_unstable();
        older.ids.retain(|id| ascending.binary_search(id).is_err());
        older.put_last(&newer.ids);
        *self = older;
    }

    /// Forgets all.
    pub(crate) fn clear(&mut self) {
        self.ids = Vec::new();
    }

    /// Adds ids that it does not hold yet; the oldest make room.
    fn put_last(&mut self, ids: &[u64]) {
        self.ids.extend_from_slice(ids);
        let surplus = self.ids.len().saturating_sub(MOST);
        self.ids.drain(..surplus);
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.ids.is_empty()
    }

    /// The share that the points of an observation, ascending, and these have in common, 0..=1; `None` when
    /// either has none.
    pub(crate) fn shared_share(&self, own: &[u64]) -> Option<f64> {
        let fewest = own.len().min(self.ids.len());
        let common = self.ids.iter().filter(|id| own.binary_search(id).is_ok()).count();
        (fewest > 0).then(|| common as f64 / fewest as f64)
    }

    /// Bytes that they own.
    pub(crate) fn memory_bytes(&self) -> usize {
        self.ids.capacity() * size_of::<u64>()
    }

    /// Whether no id is there twice; in a damaged file one may be.
    #[cfg(feature = "state")]
    pub(crate) fn is_possible(&self) -> bool {
        let mut ascending = self.ids.clone();
        ascending.sort_unstable();
        ascending.is_sorted_by(|a, b| a < b)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn those_sighted_longest_ago_make_room() {
        let mut points = SightedPoints::default();
        assert_eq!(points.shared_share(&[1]), None);
        points.add(&[1, 2, 3]);
        points.add(&[1, 4]);
        assert_eq!(points.ids, [2, 3, 1, 4]);
        assert_eq!(points.shared_share(&[1, 2, 9]), Some(2.0 / 3.0));
        let many: Vec<u64> = (100..100 + MOST as u64 - 2).collect();
        points.add(&many);
        assert_eq!((points.ids.len(), &points.ids[..3]), (MOST, &[1, 4, 100][..]));
        points.add(&(0..2 * MOST as u64).collect::<Vec<_>>());
        assert_eq!((points.ids.len(), points.ids[0]), (MOST, MOST as u64));
        points.clear();
        assert!(points.is_empty());
    }

    #[test]
    fn of_two_objects_those_of_the_one_seen_last_stay() {
        let points = |ids: &[u64]| SightedPoints { ids: ids.to_vec() };
        for (is_later, merged) in [(true, [7, 3, 9, 1]), (false, [9, 3, 1, 7])] {
            let mut own = points(&[3, 1, 7]);
            own.merge(&points(&[3, 9, 1]), is_later);
            assert_eq!(own.ids, merged, "each once");
        }
    }
}
