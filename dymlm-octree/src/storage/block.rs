use dymlm_core::Rgb;

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
    /// Log-odds; 0 where nothing is known.
    pub(super) log_odds: [f32; ENTRIES],
}

impl Block {
    pub(super) const EMPTY: Self =
        Self { known: [0; 8], max: f32::NEG_INFINITY, colors: EntryColors::NONE, log_odds: [0.0; ENTRIES] };

    /// A block that is all one leaf.
    pub(super) fn filled(log_odds: f32, color: Rgb) -> Self {
        Self {
            known: [u64::MAX; 8],
            max: log_odds,
            colors: EntryColors::filled(color),
            log_odds: [log_odds; ENTRIES],
        }
    }

    /// The log-odds of a cell; `None` where nothing is known.
    #[inline]
    pub(super) fn cell(&self, entry: usize) -> Option<f32> {
        has(&self.known, entry).then(|| self.log_odds[entry])
    }

    /// Sets the log-odds of a cell; `None` forgets it, with its colour. `max` is left to [`Self::refresh`].
    pub(super) fn set(&mut self, entry: usize, log_odds: Option<f32>) {
        self.log_odds[entry] = log_odds.unwrap_or(0.0);
        self.known[entry / 64] &= !(1 << (entry % 64));
        self.known[entry / 64] |= u64::from(log_odds.is_some()) << (entry % 64);
        if log_odds.is_none() {
            self.colors.set(entry, NO_COLOR);
        }
    }

    /// Adds one observation to each chosen cell. `max` is left to [`Self::refresh`].
    pub(super) fn observe(&mut self, misses: &Bits, hits: &Bits, model: &OccupancyModel) {
        self.add(misses, model.miss, model);
        self.add(hits, model.hit, model);
    }

    fn add(&mut self, cells: &Bits, update: f32, model: &OccupancyModel) {
        for ((&word, known), values) in
            cells.iter().zip(&mut self.known).zip(self.log_odds.chunks_exact_mut(64))
        {
            *known |= word;
            if word == u64::MAX {
                for value in values {
                    *value = model.updated(*value, update);
                }
                continue;
            }
            let mut rest = word;
            while rest != 0 {
                let value = &mut values[rest.trailing_zeros() as usize];
                *value = model.updated(*value, update);
                rest &= rest - 1;
            }
        }
    }

    /// Brings `max` up to date.
    pub(super) fn refresh(&mut self) {
        let mut max = f32::NEG_INFINITY;
        for (&known, values) in self.known.iter().zip(self.log_odds.chunks_exact(64)) {
            if known == u64::MAX {
                max = largest(values).max(max);
            } else {
                let mut rest = known;
                while rest != 0 {
                    max = values[rest.trailing_zeros() as usize].max(max);
                    rest &= rest - 1;
                }
            }
        }
        self.max = max;
    }

    /// The one value of all cells, if there is one.
    pub(super) fn single_value(&self) -> Option<f32> {
        let first = self.log_odds[0];
        (self.known == [u64::MAX; 8] && self.log_odds.iter().all(|&value| value == first)).then_some(first)
    }
}

/// The largest of 64 values, in eight lanes.
fn largest(values: &[f32]) -> f32 {
    let mut lanes = [f32::NEG_INFINITY; 8];
    for chunk in values.chunks_exact(8) {
        for (lane, &value) in lanes.iter_mut().zip(chunk) {
            *lane = if value > *lane { value } else { *lane };
        }
    }
    lanes.into_iter().fold(f32::NEG_INFINITY, f32::max)
}
