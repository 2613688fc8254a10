use dymlm_core::Rgb;

use super::cells::Cells;
use super::colors::EntryColors;
use super::{Bits, ENTRIES, NO_COLOR, has};
use crate::occupancy_model::OccupancyModel;

/// 8 x 8 x 8 cells.
#[derive(Debug, Clone)]
pub(crate) struct Block {
    /// Cells that have been observed.
    pub(super) known: Bits,
    /// Largest log-odds of a known cell.
    pub(super) max: f32,
    pub(super) colors: EntryColors,
    /// Log-odds. In a table, a cell has a place just when its bit in `known` is set.
    pub(super) cells: Cells,
}

impl Block {
    pub(super) const EMPTY: Self =
        Self { known: [0; 8], max: f32::NEG_INFINITY, colors: EntryColors::NONE, cells: Cells::EMPTY };

    /// A block that is all one leaf.
    pub(super) fn filled(log_odds: f32, color: Rgb) -> Self {
        Self {
            known: [u64::MAX; 8],
            max: log_odds,
            colors: EntryColors::filled(color),
            cells: Cells::filled(log_odds),
        }
    }

    /// The log-odds of a cell; `None` where nothing is known.
    #[inline]
    pub(super) fn cell(&self, entry: usize) -> Option<f32> {
        match &self.cells {
            Cells::Few(table) => table.get(entry),
            Cells::Many(values) => has(&self.known, entry).then(|| values[entry]),
        }
    }

    /// Sets the log-odds of a cell; `None` forgets it, with its colour. `max` is left to [`Self::refresh`].
    pub(super) fn set(&mut self, entry: usize, log_odds: Option<f32>) {
        self.cells.set(entry, log_odds);
        self.known[entry / 64] &= !(1 << (entry % 64));
        self.known[entry / 64] |= u64::from(log_odds.is_some()) << (entry % 64);
        if log_odds.is_none() {
            self.colors.set(entry, NO_COLOR);
        }
    }

    /// Whether one observation of each chosen cell leaves all of them as they are, since their values have
    /// reached the model's limits.
    pub(super) fn is_unmoved_by(&self, misses: &Bits, hits: &Bits, model: &OccupancyModel) -> bool {
        let is_unmoved = |cells: &Bits, update: f32| {
            let are_known = cells.iter().zip(&self.known).all(|(cells, known)| cells & !known == 0);
            are_known && self.cells.all(cells, |value| model.updated(value, update) == value)
        };
        is_unmoved(misses, model.miss) && is_unmoved(hits, model.hit)
    }

    /// Adds one observation to each chosen cell. `max` is left to [`Self::refresh`].
    pub(super) fn observe(&mut self, misses: &Bits, hits: &Bits, model: &OccupancyModel) {
        self.add(misses, model.miss, model);
        self.add(hits, model.hit, model);
    }

    fn add(&mut self, cells: &Bits, update: f32, model: &OccupancyModel) {
        if *cells == [0; 8] {
            return;
        }
        for (known, word) in self.known.iter_mut().zip(cells) {
            *known |= word;
        }
        self.cells.change(cells, |value| model.updated(value, update));
    }

    /// Brings `max` up to date.
    pub(super) fn refresh(&mut self) {
        self.max = self.cells.tidy(&self.known);
    }

    /// The one value of all cells, if there is one.
    pub(super) fn single_value(&self) -> Option<f32> {
        (self.known == [u64::MAX; 8] && self.cells.all_same(0..ENTRIES)).then(|| self.cells.get(0))
    }

    /// Bytes of colours and log-odds on the heap.
    pub(super) fn memory_bytes(&self) -> usize {
        self.colors.memory_bytes() + self.cells.memory_bytes()
    }
}
