use super::{Bits, ENTRIES, for_each_bit, has};

/// Log-odds of 8 x 8 x 8 cells.
///
/// They are clamped sums of two amounts, so that few different values occur in one block: five and fewer in
/// half the blocks of a mapped room, 110 at most. A table of these and one byte a cell take a quarter of the
/// memory that the values themselves do. Where more values occur (maps may be merged, and any log-odds set)
/// they are kept cell by cell, until they are few again.
#[derive(Debug, Clone)]
#[expect(clippy::large_enum_variant, reason = "nearly all cells are in the larger one")]
pub(super) enum Cells {
    Few(Table),
    /// 0 where nothing is known.
    Many(Box<[f32; ENTRIES]>),
}

/// Cells by the values that occur in them.
#[derive(Debug, Clone)]
pub(super) struct Table {
    /// Place of each cell's value, counted from 1; 0 where nothing is known.
    places: [u8; ENTRIES],
    /// All different; some may be left over from cells that have changed since.
    values: Vec<f32>,
}

/// Number of places in a table.
const PLACES: usize = u8::MAX as usize;

/// Number of values with which cells go back to a table. So few that counting up to them, at every change of
/// cells with many values, costs little; and so far from a full table that the cells stay with it.
const FEW: usize = 16;

impl Cells {
    pub(super) const EMPTY: Self = Self::Few(Table { places: [0; ENTRIES], values: Vec::new() });

    /// Cells that all have the same value.
    pub(super) fn filled(value: f32) -> Self {
        Self::Few(Table { places: [1; ENTRIES], values: vec![value] })
    }

    /// The value of a cell; 0 where nothing is known.
    #[inline]
    pub(super) fn get(&self, cell: usize) -> f32 {
        match self {
            Self::Few(table) => table.get(cell).unwrap_or(0.0),
            Self::Many(values) => values[cell],
        }
    }

    /// Sets the value of a cell; `None` forgets it.
    pub(super) fn set(&mut self, cell: usize, value: Option<f32>) {
        self.make_room(1);
        match (self, value) {
            (Self::Few(table), None) => table.places[cell] = 0,
            (Self::Few(table), Some(value)) => table.places[cell] = place_of(value, &mut table.values),
            (Self::Many(values), value) => values[cell] = value.unwrap_or(0.0),
        }
    }

    /// Changes the chosen cells' values; one of which nothing was known begins with 0.
    #[inline]
    pub(super) fn change(&mut self, cells: &Bits, change: impl Fn(f32) -> f32) {
        // Each value becomes one other at most, and so does 0.
        let count = if let Self::Few(table) = self { table.values.len() + 1 } else { 0 };
        self.make_room(count);
        match self {
            Self::Few(table) => table.change(cells, change),
            Self::Many(values) => for_each_bit(cells, |cell| values[cell] = change(values[cell])),
        }
    }

    /// Whether `holds` for the value of each chosen cell; of all of them something is known.
    pub(super) fn all(&self, cells: &Bits, holds: impl Fn(f32) -> bool) -> bool {
        match self {
            Self::Few(table) => table.all(cells, holds),
            Self::Many(values) => {
                let mut words = cells.iter().zip(values.as_chunks::<64>().0);
                words.all(|(&word, values)| all_bits(word, |bit| holds(values[bit])))
            }
        }
    }

    /// Whether all of these cells, of which something is known, have the same value.
    #[inline]
    pub(super) fn all_same(&self, mut cells: std::ops::Range<usize>) -> bool {
        let first = cells.start;
        match self {
            Self::Few(table) if table.get(first) != Some(0.0) => {
                cells.all(|cell| table.places[cell] == table.places[first])
            }
            // Two places may hold zeros, one of them negative.
            _ => cells.all(|cell| self.get(cell) == self.get(first)),
        }
    }

    /// Tidies up after changes. Returns the largest value of the known cells.
    pub(super) fn tidy(&mut self, known: &Bits) -> f32 {
        if let Self::Many(values) = self
            && let Some(table) = Table::of_few(values, known)
        {
            *self = Self::Few(table);
        }
        let mut max = f32::NEG_INFINITY;
        match self {
            Self::Few(table) => return table.tidy(),
            Self::Many(values) => for_each_bit(known, |cell| max = max.max(values[cell])),
        }
        max
    }

    /// Bytes held on the heap.
    pub(super) fn memory_bytes(&self) -> usize {
        match self {
            Self::Few(table) => size_of::<f32>() * table.values.capacity(),
            Self::Many(_) => size_of::<[f32; ENTRIES]>(),
        }
    }

    /// Makes room for more values in the table, or goes over to values cell by cell.
    #[inline]
    fn make_room(&mut self, count: usize) {
        if let Self::Few(table) = self
            && table.values.len() + count > PLACES
        {
            table.drop_unused();
            if 2 * table.values.len() + 1 > PLACES {
                *self = Self::Many(Box::new(std::array::from_fn(|cell| table.get(cell).unwrap_or(0.0))));
            }
        }
    }
}

impl Table {
    /// The known cells' values, if they are few.
    fn of_few(values: &[f32; ENTRIES], known: &Bits) -> Option<Self> {
        let mut table = Self { places: [0; ENTRIES], values: Vec::new() };
        for cell in (0..ENTRIES).filter(|&cell| has(known, cell)) {
            table.places[cell] = place_of(values[cell], &mut table.values);
            if table.values.len() > FEW {
                return None;
            }
        }
        Some(table)
    }

    /// The value of a cell; `None` where nothing is known.
    #[inline]
    pub(super) fn get(&self, cell: usize) -> Option<f32> {
        self.value(self.places[cell])
    }

    #[inline]
    fn value(&self, place: u8) -> Option<f32> {
        // Place 0 becomes a number without a value.
        self.values.get(usize::from(place).wrapping_sub(1)).copied()
    }

    /// To be called with enough room.
    #[inline]
    fn change(&mut self, cells: &Bits, change: impl Fn(f32) -> f32) {
        // Where the value of each place goes; 0 while not known.
        let mut moved = [0; PLACES + 1];
        let Self { places, values } = self;
        let mut after = |place: u8| {
            let to = &mut moved[usize::from(place)];
            if *to == 0 {
                let old = values.get(usize::from(place).wrapping_sub(1)).copied().unwrap_or(0.0);
                *to = place_of(change(old), values);
            }
            *to
        };
        for (&word, places) in cells.iter().zip(places.as_chunks_mut().0) {
            if word == u64::MAX
                && let Some(place) = common_place(places)
            {
                *places = [after(place); 64];
                continue;
            }
            let mut rest = word;
            while rest != 0 {
                let place = &mut places[rest.trailing_zeros() as usize];
                *place = after(*place);
                rest &= rest - 1;
            }
        }
    }

    /// Whether `holds` for the value of each chosen cell; of all of them something is known.
    fn all(&self, cells: &Bits, holds: impl Fn(f32) -> bool) -> bool {
        let mut held = [false; PLACES + 1];
        for (held, &value) in held[1..].iter_mut().zip(&self.values) {
            *held = holds(value);
        }
        let in_word = |word: u64, places: &[u8; 64]| {
            if word == u64::MAX
                && let Some(place) = common_place(places)
            {
                return held[usize::from(place)];
            }
            all_bits(word, |bit| held[usize::from(places[bit])])
        };
        cells.iter().zip(self.places.as_chunks().0).all(|(&word, places)| in_word(word, places))
    }

    /// Drops unused values when they are the most. Returns the largest of the others.
    fn tidy(&mut self) -> f32 {
        let (mut max, mut count) = (f32::NEG_INFINITY, 0);
        for (&value, _) in self.values.iter().zip(&self.used()[1..]).filter(|(_, used)| **used) {
            max = max.max(value);
            count += 1;
        }
        if self.values.len() > 2 * count {
            self.drop_unused();
        }
        max
    }

    /// Which places occur.
    fn used(&self) -> [bool; PLACES + 1] {
        let mut used = [false; PLACES + 1];
        for places in self.places.as_chunks().0 {
            if let Some(place) = common_place(places) {
                used[usize::from(place)] = true;
            } else {
                for &place in places {
                    used[usize::from(place)] = true;
                }
            }
        }
        used
    }

    /// Drops the values that no cell has any longer.
    fn drop_unused(&mut self) {
        let used = self.used();
        let mut moved = [0; PLACES + 1];
        let mut kept = Vec::new();
        for (i, &value) in self.values.iter().enumerate() {
            if used[i + 1] {
                kept.push(value);
                moved[i + 1] = kept.len() as u8;
            }
        }
        for place in &mut self.places {
            *place = moved[usize::from(*place)];
        }
        self.values = kept;
    }
}

/// Whether `holds` for each bit that is set, the lowest first.
#[inline]
fn all_bits(mut word: u64, holds: impl Fn(usize) -> bool) -> bool {
    while word != 0 {
        if !holds(word.trailing_zeros() as usize) {
            return false;
        }
        word &= word - 1;
    }
    true
}

/// The place of all of 64 cells, if it is the same: free space is mostly of one value.
#[inline]
fn common_place(places: &[u8; 64]) -> Option<u8> {
    let place = places[0];
    (*places == [place; 64]).then_some(place)
}

/// The place of a value in a table, which is lengthened if needed. Values are compared bit by bit.
#[inline]
fn place_of(value: f32, values: &mut Vec<f32>) -> u8 {
    let found = values.iter().position(|other| other.to_bits() == value.to_bits());
    let index = found.unwrap_or_else(|| {
        values.push(value);
        values.len() - 1
    });
    (index + 1) as u8
}

#[cfg(test)]
mod tests {
    use dymlm_core::SplitMix64;

    use super::*;

    /// Cells, and the same in an array.
    struct Checked {
        cells: Cells,
        known: Bits,
        expected: [Option<f32>; ENTRIES],
    }

    impl Checked {
        fn new() -> Self {
            Self { cells: Cells::EMPTY, known: [0; 8], expected: [None; ENTRIES] }
        }

        fn set(&mut self, cell: usize, value: Option<f32>) {
            self.cells.set(cell, value);
            self.known[cell / 64] &= !(1 << (cell % 64));
            self.known[cell / 64] |= u64::from(value.is_some()) << (cell % 64);
            self.expected[cell] = value;
        }

        fn change(&mut self, chosen: &Bits, change: impl Fn(f32) -> f32) {
            self.cells.change(chosen, &change);
            for (known, chosen) in self.known.iter_mut().zip(chosen) {
                *known |= chosen;
            }
            for_each_bit(chosen, |cell| {
                self.expected[cell] = Some(change(self.expected[cell].unwrap_or(0.0)));
            });
        }

        fn check(&mut self) {
            let max = self.expected.iter().flatten().copied().fold(f32::NEG_INFINITY, f32::max);
            assert_eq!(self.cells.tidy(&self.known), max);
            for (cell, expected) in self.expected.iter().enumerate() {
                assert_eq!(self.cells.get(cell), expected.unwrap_or(0.0));
                if let Cells::Few(table) = &self.cells {
                    assert_eq!(table.get(cell), *expected);
                }
            }
        }
    }

    /// Random changes with `kinds` values that a cell may be set to.
    fn changed_at_random(kinds: usize) -> Cells {
        let mut random = SplitMix64::new(kinds as u64);
        let mut checked = Checked::new();
        for _ in 0..400 {
            for _ in 0..20 {
                let value = Some(random.below(kinds) as f32).filter(|_| random.below(4) > 0);
                checked.set(random.below(ENTRIES), value);
            }
            let chosen = std::array::from_fn(|_| [0, u64::MAX, 1 << random.below(64)][random.below(3)]);
            checked.change(&chosen, |value| (value + 0.5).min(kinds as f32));
            checked.check();
        }
        checked.cells
    }

    #[test]
    fn few_values_are_kept_in_a_table() {
        let Cells::Few(table) = changed_at_random(10) else { unreachable!("20 values have room in a table") };
        assert!(table.values.len() <= 2 * 21, "unused values are dropped: {}", table.values.len());
    }

    #[test]
    fn many_values_are_kept_cell_by_cell() {
        assert!(matches!(changed_at_random(2000), Cells::Many(_)));
    }

    #[test]
    fn a_table_is_kept_again_once_values_are_few() {
        let mut checked = Checked::new();
        for round in 0..3 {
            (0..400).for_each(|cell| checked.set(cell, Some(cell as f32 - 200.0)));
            checked.set(round, None);
            checked.check();
            assert!(matches!(checked.cells, Cells::Many(_)));

            let chosen = checked.known;
            checked.change(&chosen, |value| value.clamp(0.0, 5.0));
            checked.check();
            assert!(matches!(checked.cells, Cells::Few(_)));
            assert!(checked.cells.memory_bytes() <= 64);
        }
    }

    #[test]
    fn zeros_of_either_sign_are_the_same() {
        let mut cells = Cells::filled(0.0);
        cells.set(7, Some(-0.0));
        assert!(cells.all_same(0..ENTRIES));
        cells.set(7, Some(1.0));
        assert!(!cells.all_same(0..ENTRIES) && cells.all_same(8..16));
    }
}
