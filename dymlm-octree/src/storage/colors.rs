use std::sync::Arc;

use dymlm_core::Rgb;

use super::{ENTRIES, NO_COLOR, mean_color};

/// The colours of a node's entries. Nothing is held while none has one; clones share them until they change.
#[derive(Debug, Clone)]
pub(super) struct EntryColors(Option<Arc<[Rgb; ENTRIES]>>);

impl EntryColors {
    pub(super) const NONE: Self = Self(None);

    /// All of one colour.
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

    /// The mean of some entries' colours, of those that have one.
    pub(super) fn mean(&self, entries: std::ops::Range<usize>) -> Rgb {
        self.0.as_ref().map_or(NO_COLOR, |colors| mean_color(colors[entries].iter().copied()))
    }

    /// All of them, if any entry has one.
    #[cfg(feature = "state")]
    pub(super) fn to_vec(&self) -> Option<Vec<Rgb>> {
        self.0.as_ref().map(|colors| colors.to_vec())
    }

    /// What [`to_vec`](Self::to_vec) gave; `None` where it gave something else, or may give nothing.
    #[cfg(feature = "state")]
    pub(super) fn of_vec(colors: Option<Vec<Rgb>>, may_be: bool) -> Option<Self> {
        let Some(colors) = colors else { return Some(Self::NONE) };
        let colors: [Rgb; ENTRIES] = colors.try_into().ok()?;
        may_be.then(|| Self(Some(Arc::new(colors))))
    }

    /// Bytes held elsewhere.
    pub(super) fn memory_bytes(&self) -> usize {
        if self.0.is_some() { super::shared_bytes::<[Rgb; ENTRIES]>() } else { 0 }
    }
}

/// The colour of a cell after another reading, as OctoMap's `averageNodeColor` has it: half and half.
pub(super) fn averaged(old: Rgb, new: Rgb) -> Rgb {
    let blended = if old == NO_COLOR { new } else { half_and_half(old, new) };
    // Pure white means "no colour" in the files: keep a hair's breadth away from it.
    if blended == NO_COLOR { [255, 255, 254] } else { blended }
}

/// Two colours half and half, or the one there is.
pub(super) fn blended(a: Rgb, b: Rgb) -> Rgb {
    match (a, b) {
        (NO_COLOR, only) | (only, NO_COLOR) => only,
        _ => half_and_half(a, b),
    }
}

fn half_and_half(a: Rgb, b: Rgb) -> Rgb {
    std::array::from_fn(|i| u16::midpoint(u16::from(a[i]), u16::from(b[i])) as u8)
}
