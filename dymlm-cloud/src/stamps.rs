use dymlm_core::Pages;

/// The number of each block's last change, by slot. Changed blocks are found by the newest number of each 64
/// slots: this reads one number in 64, and the numbers beside one that has changed.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stamps {
    slots: Pages<u32>,
    /// The newest number of each page of slots.
    newest: Pages<u32>,
}

impl Stamps {
    /// The last change of a slot's block; 0 for one that has not changed.
    pub(crate) fn of(&self, slot: usize) -> u32 {
        self.slots.get(slot).copied().unwrap_or(0)
    }

    /// Notes a change of a block; its number is not smaller than that of the change before.
    #[inline]
    pub(crate) fn note(&mut self, slot: usize, stamp: u32) {
        if self.slots.get(slot) == Some(&stamp) {
            return;
        }
        self.slots.grow(slot + 1, || 0);
        self.slots.set(slot, stamp);
        let page = slot / Pages::<u32>::PAGE;
        if self.newest.get(page).is_none_or(|newest| *newest < stamp) {
            self.newest.grow(page + 1, || 0);
            self.newest.set(page, stamp);
        }
    }

    /// Slots whose blocks have changed after `stamp`, in order.
    pub(crate) fn after(&self, stamp: u32) -> impl Iterator<Item = usize> {
        let pages = self.newest.iter().enumerate().filter(move |(_, newest)| **newest > stamp);
        let slots = pages.flat_map(|(page, _)| page * Pages::<u32>::PAGE..(page + 1) * Pages::<u32>::PAGE);
        slots.filter(move |&slot| self.of(slot) > stamp)
    }

    /// Slots noted since an earlier state, and others of their pages.
    #[cfg(feature = "state")]
    pub(crate) fn unshared<'a>(&'a self, earlier: &'a Self) -> impl Iterator<Item = usize> + 'a {
        self.slots.unshared(&earlier.slots)
    }

    /// Keeps the slots for which `stays` is true; they move to lower slots.
    pub(crate) fn keep(&mut self, stays: &[bool]) {
        self.slots.grow(stays.len(), || 0);
        self.slots.keep(stays);
        self.newest = self.slots.pages().map(|page| page.iter().copied().max().unwrap_or(0)).collect();
    }

    /// Gives the last changes of all blocks one number.
    pub(crate) fn set_all(&mut self, stamp: u32) {
        self.slots.iter_mut().chain(self.newest.iter_mut()).for_each(|noted| *noted = stamp);
    }

    /// Bytes held that other stamps do not share.
    pub(crate) fn memory_bytes_beside(&self, other: &Self) -> usize {
        self.slots.memory_bytes_beside(&other.slots) + self.newest.memory_bytes_beside(&other.newest)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_changed_is_what_a_look_at_all_finds() {
        let mut stamps = Stamps::default();
        let mut all = vec![0; 1000];
        for stamp in 1..=400_u32 {
            let slot = (stamp * stamp * 31 % 1000) as usize;
            stamps.note(slot, stamp);
            all[slot] = stamp;
        }
        let stays: Vec<bool> = (0..1000).map(|slot| slot % 3 > 0).collect();
        let mut kept = stamps.clone();
        kept.keep(&stays);
        let rest: Vec<u32> = all.iter().zip(&stays).filter(|(_, stays)| **stays).map(|(at, _)| *at).collect();
        for (stamps, all) in [(stamps, all), (kept, rest)] {
            for since in [0, 1, 250, 399, 400] {
                let looked = all.iter().enumerate().filter(|(_, stamp)| **stamp > since);
                assert!(stamps.after(since).eq(looked.map(|(slot, _)| slot)), "after {since}");
            }
        }
    }
}
