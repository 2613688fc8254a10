use std::collections::BTreeMap;

use dymlm_core::{DamagedState, StateSink, decode_part, encode_part};

use crate::history::{Place, Slot};
use crate::{Error, History, HistoryConfig};

/// The part that says which numbers are in use; the part of what is kept under number n is n + 1.
const HEAD: u64 = 0;

/// Which numbers are in use.
#[derive(serde::Serialize, serde::Deserialize)]
struct Head {
    /// How many numbers have been given.
    len: usize,
    /// Numbers under which nothing is kept any more.
    removed: Vec<usize>,
}

impl History {
    /// Gives to `sink` the parts of the history that differ from an earlier one, or all parts without an
    /// earlier one. What is kept under a number never changes: a key frame of the earlier history is not
    /// written again, packed or not.
    ///
    /// # Errors
    ///
    /// Those of `sink`, and of a file that cannot be read.
    pub fn save_state(&self, earlier: Option<&Self>, sink: &mut StateSink<'_>) -> std::io::Result<()> {
        let is_held = |slot: &&Slot| !matches!(slot.place, Place::Removed);
        let before = |index| earlier.and_then(|earlier| earlier.slots.get(index)).filter(is_held);
        for (index, slot) in self.slots.iter().enumerate() {
            match (Some(slot).filter(is_held), before(index)) {
                (None, None) => {}
                (None, Some(_)) => sink(part_of(index), None)?,
                (Some(slot), Some(before)) if slot.is_same(before) => {}
                (Some(slot), _) => sink(part_of(index), Some(&self.packed(&slot.place)?))?,
            }
        }
        for index in self.slots.len()..earlier.map_or(0, |earlier| earlier.slots.len()) {
            if before(index).is_some() {
                sink(part_of(index), None)?;
            }
        }
        let head = encode_part(&self.head())?;
        let is_known = match earlier {
            Some(earlier) => encode_part(&earlier.head())? == head,
            None => false,
        };
        if is_known { Ok(()) } else { sink(HEAD, Some(&head)) }
    }

    /// Restores the history from its parts, in any order; `None` when the config wants none. What is kept
    /// under a number is not read before it is asked for.
    ///
    /// # Errors
    ///
    /// [`Error::Create`] when the config's folder takes no file; [`Error::State`] names a part that is
    /// damaged, missing or superfluous.
    pub fn load_state(
        config: &HistoryConfig,
        parts: impl IntoIterator<Item = (u64, Vec<u8>)>,
    ) -> Result<Option<Self>, Error> {
        let Some(mut history) = Self::new(config)? else { return Ok(None) };
        // Stored one by one: all parts together are larger than the maps.
        let (mut kept, mut head) = (BTreeMap::new(), None);
        for (part, bytes) in parts {
            let before = if part == HEAD {
                head.replace(bytes).map(|_| ())
            } else {
                // The part of number n is n + 1.
                let place = history.put_away((part - 1) as usize, bytes.into());
                kept.insert(part, place).map(|_| ())
            };
            if before.is_some() {
                return Err(DamagedState::new(part, "it is there twice").into());
            }
        }
        let head = head.ok_or_else(|| DamagedState::new(HEAD, "it is missing"))?;
        let Head { len, removed } = decode_part(HEAD, &head)?;
        // Checked first, so that a damaged head cannot make the list longer than the parts that are there.
        if len != kept.len() + removed.len() {
            let what = format!("{len} numbers, but {} parts and {} removed", kept.len(), removed.len());
            return Err(DamagedState::new(HEAD, what).into());
        }
        for index in 0..len {
            let place = match kept.remove(&part_of(index)) {
                Some(place) => place,
                None if removed.binary_search(&index).is_ok() => Place::Removed,
                None => return Err(DamagedState::new(part_of(index), "it is missing").into()),
            };
            history.push_slot(Slot::new(place));
        }
        Ok(Some(history))
    }

    fn head(&self) -> Head {
        let slots = self.slots.iter().enumerate();
        let removed = slots.filter(|(_, slot)| matches!(slot.place, Place::Removed)).map(|(index, _)| index);
        Head { len: self.slots.len(), removed: removed.collect() }
    }
}

fn part_of(index: usize) -> u64 {
    index as u64 + 1
}
