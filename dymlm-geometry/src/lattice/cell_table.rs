/// Numbers distinct keys from 1 in the order of their first appearance.
///
/// An open-addressing hash table with linear probing, at most half full: expected O(1) per key.
#[derive(Debug, Clone, Default)]
pub(super) struct CellTable {
    /// Numbers, 0 in free places; a power of two of them.
    places: Vec<u32>,
    /// Key by number.
    keys: Vec<u64>,
    /// Shifting a hash to the right by this many bits gives its place.
    shift: u32,
}

/// No key; it stands at number 0.
const FREE: u64 = u64::MAX - 1;

/// Multiplying by 2^64 over the golden ratio spreads keys over the upper bits (Knuth, vol. 3, 6.4).
#[inline]
pub(super) fn spread(key: u64) -> u64 {
    key.wrapping_mul(0x9E37_79B9_7F4A_7C15)
}

/// Smallest number of places.
const MIN_PLACES: usize = 1024;

impl CellTable {
    /// Forgets all keys. Places are kept unless there are more than `at_most` keys need; at first there are
    /// enough for a quarter of the keys.
    pub(super) fn clear(&mut self, at_most: usize) {
        let enough = at_most.saturating_mul(2).next_power_of_two();
        let known = if self.places.is_empty() { enough / 4 } else { self.places.len() };
        let places = known.min(enough).max(MIN_PLACES);
        self.keys.clear();
        self.keys.reserve(places / 2 + 1);
        self.keys.push(FREE);
        self.make_places(places);
    }

    /// Key by number, with one that stands for none at 0.
    pub(super) fn keys(&self) -> &[u64] {
        &self.keys
    }

    /// The number of a key other than 2^64 - 2, a new number for a new key.
    #[inline]
    pub(super) fn number(&mut self, key: u64) -> u32 {
        let mask = self.places.len() - 1;
        let mut place = (spread(key) >> self.shift) as usize;
        loop {
            let number = self.places[place & mask];
            if self.keys[number as usize] == key {
                return number;
            }
            if number == 0 {
                return self.insert(place & mask, key);
            }
            place += 1;
        }
    }

    #[inline]
    fn insert(&mut self, place: usize, key: u64) -> u32 {
        let number = self.keys.len() as u32;
        self.places[place] = number;
        self.keys.push(key);
        if self.keys.len() * 2 > self.places.len() {
            self.grow();
        }
        number
    }

    #[cold]
    fn grow(&mut self) {
        self.make_places(self.places.len() * 2);
        let mask = self.places.len() - 1;
        for (number, &key) in (0..).zip(&self.keys).skip(1) {
            let mut place = (spread(key) >> self.shift) as usize;
            while self.places[place & mask] != 0 {
                place += 1;
            }
            self.places[place & mask] = number;
        }
    }

    fn make_places(&mut self, count: usize) {
        self.places.clear();
        self.places.resize(count, 0);
        self.shift = u64::BITS - count.trailing_zeros();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keys_in_the_order_of_appearance() {
        let mut table = CellTable::default();
        for at_most in [100_000, 10, 100_000] {
            table.clear(at_most);
            assert_eq!(table.keys(), [FREE]);
            for round in 0..2 {
                // Neighbours, far ones, and the greatest.
                for key in (0..3_000_u64).map(|i| i * i % 3_001 * (1 + (i % 3) * 1_000_003)).chain([u64::MAX])
                {
                    let before = table.keys().len();
                    let number = table.number(key) as usize;
                    assert_eq!(table.keys()[number], key);
                    assert!(number == before && round == 0 || number < before, "{key} {number}");
                }
            }
            let mut keys = table.keys().to_vec();
            keys.sort_unstable();
            assert!(keys.windows(2).all(|pair| pair[0] < pair[1]));
        }
    }
}
