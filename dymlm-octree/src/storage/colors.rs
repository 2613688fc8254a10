use std::sync::Arc;

use dymlm_core::Rgb;

use super::{ENTRIES, NO_COLOR, mean_color};

/// The colours of a node's entries. Nothing is stored while no entry has a colour; clones share the colours
/// until they change.
#[derive(Debug, Clone)]
pub(super) struct EntryColors(Option<Arc<[Rgb; ENTRIES]>>);

impl EntryColors {
    pub(super) const NONE: Self = Self(None);

    /// The same colour for all entries.
    pub(super) fn filled(color: Rgb) -> Self {
        Self((color != NO_COLOR).then(|| Arc::new([color; ENTRIES])))
    }

    /// The colour of an entry; [`NO_COLOR`] without one.
    pub(super) fn at(&self, entry: usize) -> Rgb {
        self.0.as_ref().map_or(NO_COLOR, |colors| colors[entry])
    }

    pub(super) fn set(&mut self, entry: usize, color: Rgb) {
        if self.at(entry) != color {
            Arc::make_mut(self.0.get_or_insert_with(|| Arc::new([NO_COLOR; ENTRIES])))[entry] = color;
        }
    }

    /// The mean colour of those of the entries that have one.
    pub(super) fn mean(&self, entries: std::ops::Range<usize>) -> Rgb {
        self.0.as_ref().map_or(NO_COLOR, |colors| mean_color(colors[entries].iter().copied()))
    }

    /// The colours of all entries, if any were stored.
    #[cfg(feature = "state")]
    pub(super) fn to_vec(&self) -> Option<Vec<Rgb>> {
        self.0.as_ref().map(|colors| colors.to_vec())
    }

    /// The colours that [`to_vec`](Self::to_vec) gave; `None` for a vector of another length, and for colours
    /// where there may be none.
    #[cfg(feature = "state")]
    pub(super) fn of_vec(colors: Option<Vec<Rgb>>, may_be: bool) -> Option<Self> {
        let Some(colors) = colors else { return Some(Self::NONE) };
        let colors: [Rgb; ENTRIES] = colors.try_into().ok()?;
        may_be.then(|| Self(Some(Arc::new(colors))))
    }

    /// Bytes held on the heap.
    pub(super) fn memory_bytes(&self) -> usize {
        if self.0.is_some() { super::shared_bytes::<[Rgb; ENTRIES]>() } else { 0 }
    }
}

/// The colour of a cell after another reading, as OctoMap's `averageNodeColor` has it: half and half.
pub(super) fn averaged(old: Rgb, new: Rgb) -> Rgb {
    let blended = if old == NO_COLOR { new } else { half_and_half(old, new) };
    // Pure white means "no colour" in the files: the nearest other colour is stored.
    if blended == NO_COLOR { [255, 255, 254] } else { blended }
}

/// Two colours half and half, or the only one given.
pub(super) fn blended(a: Rgb, b: Rgb) -> Rgb {
    match (a, b) {
        (NO_COLOR, only) | (only, NO_COLOR) => only,
        _ => half_and_half(a, b),
    }
}

fn half_and_half(a: Rgb, b: Rgb) -> Rgb {
    std::array::from_fn(|i| u16::midpoint(u16::from(a[i]), u16::from(b[i])) as u8)
}
