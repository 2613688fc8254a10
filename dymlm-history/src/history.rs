use std::collections::VecDeque;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use dymlm_core::{Frame, Pages, Point, ScratchFile};

use crate::kept::Kept;
use crate::packer::Packer;
use crate::packing_buffers::PackingBuffers;
use crate::{Error, Observation};

/// Where key-frame observations and scans are kept.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
#[cfg_attr(feature = "serde", serde(rename_all = "snake_case"))]
#[non_exhaustive]
pub enum HistoryConfig {
    /// Nowhere: poses cannot be corrected. Memory then grows with time by what key frames have seen of planes, 1
    /// to 2 kB each, which planes that merge need; a budget of memory puts that into a file.
    #[default]
    None,
    /// In memory: some 65 kB per key frame of 640x480, 8 bytes per point of a scan.
    Memory,
    /// In a file without a name in this folder, which must exist; the file is deleted with the history. What
    /// it does not take, on a full disk, stays in memory until it does: see [`History::unfiled_bytes`].
    Folder(PathBuf),
}

/// Key-frame observations and scans by number, packed.
///
/// They are packed on a thread of their own, so that adding one does not wait. A clone shares what is kept,
/// and the file.
#[derive(Debug, Clone)]
pub struct History {
    pub(crate) slots: Pages<Slot>,
    /// Each clone has its own: what was not yet packed when a history was cloned stays unpacked in the clone.
    packer: Packer,
    pub(crate) file: Option<Arc<ScratchFile>>,
    /// Bytes of all packed things that are in memory.
    packed_bytes: usize,
    /// Numbers of what the file has refused, and which therefore stays in memory; the first one is written
    /// next.
    unfiled: VecDeque<usize>,
    /// Why the file has refused something last, as long as such things are in memory.
    failure: Option<Arc<std::io::Error>>,
    /// The disk is full.
    #[cfg(test)]
    is_full: bool,
}

/// Most of what a file has refused earlier that is written with one thing that it takes: so that nobody waits
/// for long.
const MOST_AGAIN: usize = 8;

/// What is kept under a number.
#[derive(Debug, Clone)]
pub(crate) struct Slot {
    /// The same for all slots that got the same thing from each other, wherever each of them keeps it.
    identity: u64,
    pub(crate) place: Place,
}

/// Where something is kept.
#[derive(Debug, Clone)]
pub(crate) enum Place {
    /// It is being packed.
    Whole(Kept),
    Packed(Arc<[u8]>),
    /// Its place in the file.
    Filed {
        offset: u64,
        length: usize,
    },
    Removed,
}

impl Slot {
    /// Of something that no other slot holds.
    #[cfg(feature = "state")]
    pub(crate) fn new(place: Place) -> Self {
        Self { identity: next_identity(), place }
    }

    /// Whether both got what they hold from each other, or from the same third one.
    #[cfg(feature = "state")]
    pub(crate) fn is_same(&self, other: &Self) -> bool {
        self.identity == other.identity
    }
}

fn next_identity() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    // Identities are only compared, so that results do not depend on their numbers.
    NEXT.fetch_add(1, Ordering::Relaxed)
}

impl History {
    /// An empty history; `None` when none is to be kept.
    ///
    /// # Errors
    ///
    /// [`Error::Create`].
    pub fn new(config: &HistoryConfig) -> Result<Option<Self>, Error> {
        let file = match config {
            HistoryConfig::None => return Ok(None),
            HistoryConfig::Memory => None,
            HistoryConfig::Folder(folder) => {
                let file = ScratchFile::create_in(folder, "history");
                Some(Arc::new(file.map_err(|source| Error::Create { folder: folder.clone(), source })?))
            }
        };
        Ok(Some(Self::in_file(file)))
    }

    fn in_file(file: Option<Arc<ScratchFile>>) -> Self {
        Self {
            slots: Pages::default(),
            packer: Packer::default(),
            file,
            packed_bytes: 0,
            unfiled: VecDeque::new(),
            failure: None,
            #[cfg(test)]
            is_full: false,
        }
    }

    /// The observation of a frame, as [`Observation::of_frame`] makes it, in the buffers of one that has been packed
    /// where there is one.
    ///
    /// # Errors
    ///
    /// As [`Observation::of_frame`].
    pub fn observe(&mut self, frame: &Frame) -> Result<Observation, dymlm_core::Error> {
        self.take_packed();
        match self.packer.spare() {
            Some(spare) => spare.refilled(frame),
            None => Observation::of_frame(frame),
        }
    }

    /// Keeps an observation; returns its number. Numbers ascend from 0 and are not used again.
    pub fn push(&mut self, observation: Arc<Observation>) -> usize {
        self.keep(Kept::Observation(observation))
    }

    /// Keeps a scan's points, in the sensor's frame, metres, bit by bit, NaN included; returns their number,
    /// from the same sequence as those of observations. Packed, a lidar's point takes some 8 bytes.
    pub fn push_scan(&mut self, points: Arc<[Point]>) -> usize {
        self.keep(Kept::Scan(points))
    }

    fn keep(&mut self, kept: Kept) -> usize {
        self.keep_as(next_identity(), kept)
    }

    fn keep_as(&mut self, identity: u64, kept: Kept) -> usize {
        let index = self.slots.len();
        self.slots.push(Slot { identity, place: Place::Whole(kept.clone()) });
        self.packer.pack(index, kept);
        self.take_packed();
        index
    }

    /// An observation as it was given, bit by bit. Costs its unpacking.
    ///
    /// # Errors
    ///
    /// [`Error::Unknown`], also for a scan; [`Error::Read`], [`Error::Damaged`].
    pub fn get(&self, index: usize) -> Result<Arc<Observation>, Error> {
        match self.kept(index)? {
            Kept::Observation(observation) => Ok(observation),
            Kept::Scan(_) => Err(Error::Unknown { index }),
        }
    }

    /// A scan's points as they were given. Costs their unpacking.
    ///
    /// # Errors
    ///
    /// [`Error::Unknown`], also for an observation; [`Error::Read`], [`Error::Damaged`].
    pub fn scan(&self, index: usize) -> Result<Arc<[Point]>, Error> {
        match self.kept(index)? {
            Kept::Scan(points) => Ok(points),
            Kept::Observation(_) => Err(Error::Unknown { index }),
        }
    }

    /// An empty history that keeps things in the same place, in memory or in the same file.
    #[must_use]
    pub fn emptied(&self) -> Self {
        Self::in_file(self.file.clone())
    }

    /// Keeps what another history keeps under a number; returns its number here. Bytes that are in memory or
    /// in the same file are shared.
    ///
    /// # Errors
    ///
    /// [`Error::Unknown`]; [`Error::Read`].
    pub fn push_from(&mut self, other: &Self, index: usize) -> Result<usize, Error> {
        let is_same_file = match (&self.file, &other.file) {
            (Some(own), Some(other)) => Arc::ptr_eq(own, other),
            _ => false,
        };
        let taken = other.slots.get(index).ok_or(Error::Unknown { index })?;
        let identity = taken.identity;
        let place = match &taken.place {
            Place::Removed => return Err(Error::Unknown { index }),
            Place::Whole(kept) => return Ok(self.keep_as(identity, kept.clone())),
            &Place::Filed { offset, length } if is_same_file => Place::Filed { offset, length },
            Place::Packed(packed) if self.file.is_none() => Place::Packed(Arc::clone(packed)),
            place => {
                let packed = other.read(index, place)?;
                self.put_away(self.slots.len(), packed)
            }
        };
        self.push_slot(Slot { identity, place });
        Ok(self.slots.len() - 1)
    }

    /// The bytes of what is kept under a number: equal where the same thing is kept, whichever history keeps
    /// it.
    ///
    /// # Errors
    ///
    /// [`Error::Unknown`]; [`Error::Read`].
    pub fn bytes(&self, index: usize) -> Result<Arc<[u8]>, Error> {
        match self.place(index) {
            None | Some(Place::Removed) => Err(Error::Unknown { index }),
            Some(place) => self.read(index, place),
        }
    }

    fn place(&self, index: usize) -> Option<&Place> {
        self.slots.get(index).map(|slot| &slot.place)
    }

    fn read(&self, index: usize, place: &Place) -> Result<Arc<[u8]>, Error> {
        self.packed(place).map_err(|source| Error::Read { index, source })
    }

    /// The bytes of what is kept in a place.
    pub(crate) fn packed(&self, place: &Place) -> std::io::Result<Arc<[u8]>> {
        match place {
            Place::Whole(kept) => Ok(kept.pack(&mut PackingBuffers::default()).into()),
            Place::Packed(packed) => Ok(Arc::clone(packed)),
            &Place::Filed { offset, length } => match &self.file {
                Some(file) => Ok(file.read(offset, length)?.into()),
                None => Err(std::io::ErrorKind::NotFound.into()),
            },
            Place::Removed => Err(std::io::ErrorKind::NotFound.into()),
        }
    }

    fn kept(&self, index: usize) -> Result<Kept, Error> {
        let kept = match self.place(index) {
            None | Some(Place::Removed) => return Err(Error::Unknown { index }),
            Some(Place::Whole(kept)) => return Ok(kept.clone()),
            Some(Place::Packed(packed)) => Kept::unpack(packed),
            Some(&Place::Filed { offset, length }) => {
                let file = self.file.as_ref().ok_or(Error::Unknown { index })?;
                Kept::unpack(&file.read(offset, length).map_err(|source| Error::Read { index, source })?)
            }
        };
        kept.ok_or(Error::Damaged { index })
    }

    /// Forgets an observation or a scan. Its bytes in a file stay until the history is dropped.
    pub fn remove(&mut self, index: usize) {
        self.replace(index, Place::Removed);
    }

    /// Bytes in memory, without what is still being packed, and the buffers of packing. O(1).
    pub fn memory_bytes(&self) -> usize {
        self.packed_bytes + self.slots.memory_bytes()
    }

    /// Bytes in memory that belong into the file of [`HistoryConfig::Folder`], but could not be written: the
    /// disk is full, say. They go there as soon as the file takes something again. 0 for a history in memory.
    pub fn unfiled_bytes(&self) -> usize {
        if self.file.is_some() { self.packed_bytes } else { 0 }
    }

    /// Why the file has refused something last; `None` once everything that it had refused is written.
    pub fn failure(&self) -> Option<&std::io::Error> {
        self.failure.as_deref().filter(|_| self.unfiled_bytes() > 0)
    }

    /// Waits until everything is packed.
    pub fn settle(&mut self) {
        self.packer.finish();
        self.take_packed();
    }

    /// Puts what has been packed into its slot. What cannot be written to the file stays in memory until the
    /// file takes something again.
    fn take_packed(&mut self) {
        while let Some((index, packed)) = self.packer.next() {
            if matches!(self.place(index), Some(Place::Whole(_))) {
                let place = self.put_away(index, packed.into());
                let is_filed = matches!(place, Place::Filed { .. });
                if let Some(Place::Whole(kept)) = self.replace(index, place) {
                    self.packer.recycle(kept);
                }
                if is_filed {
                    self.file_again();
                }
            }
        }
    }

    /// Puts the packed bytes of a number into the file; without a file, or if it cannot be written, they stay
    /// in memory.
    pub(crate) fn put_away(&mut self, index: usize, packed: Arc<[u8]>) -> Place {
        match self.append(&packed) {
            None => Place::Packed(packed),
            Some(Ok(place)) => place,
            Some(Err(failure)) => {
                self.failure = Some(Arc::new(failure));
                self.unfiled.push_back(index);
                Place::Packed(packed)
            }
        }
    }

    /// Writes some of what the file had refused, when it takes things again.
    fn file_again(&mut self) {
        for _ in 0..MOST_AGAIN {
            let Some(&index) = self.unfiled.front() else { break };
            // What has been removed meanwhile needs no place.
            if let Some(Place::Packed(packed)) = self.place(index) {
                match self.append(packed) {
                    Some(Ok(place)) => _ = self.replace(index, place),
                    Some(Err(failure)) => {
                        self.failure = Some(Arc::new(failure));
                        return;
                    }
                    None => return,
                }
            }
            self.unfiled.pop_front();
        }
        if self.unfiled.is_empty() {
            self.failure = None;
        }
    }

    /// Writes bytes into the file, if there is one.
    fn append(&self, bytes: &[u8]) -> Option<std::io::Result<Place>> {
        let file = self.file.as_ref()?;
        #[cfg(test)]
        if self.is_full {
            return Some(Err(std::io::ErrorKind::StorageFull.into()));
        }
        Some(file.append(bytes).map(|offset| Place::Filed { offset, length: bytes.len() }))
    }

    /// Keeps something elsewhere; returns where it was kept.
    fn replace(&mut self, index: usize, place: Place) -> Option<Place> {
        let slot = self.slots.get_mut(index)?;
        let now = place.packed_bytes();
        let before = std::mem::replace(&mut slot.place, place);
        self.packed_bytes = self.packed_bytes + now - before.packed_bytes();
        Some(before)
    }

    pub(crate) fn push_slot(&mut self, slot: Slot) {
        self.packed_bytes += slot.place.packed_bytes();
        self.slots.push(slot);
    }
}

impl Place {
    /// Bytes of packed things in memory.
    fn packed_bytes(&self) -> usize {
        if let Self::Packed(packed) = self { packed.len() } else { 0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scan(number: u8) -> Arc<[Point]> {
        (0..500).map(|i| [number.into(), (0.37 * i as f32).sin(), 0.1 * i as f32]).collect()
    }

    /// Regression: what a full disk had refused stayed in memory for good, and nobody was told.
    #[test]
    fn what_a_full_disk_refused_is_filed_when_there_is_room_again() {
        let mut history = History::new(&HistoryConfig::Folder(std::env::temp_dir())).unwrap().unwrap();
        let keep = |history: &mut History, numbers: std::ops::Range<u8>| {
            for number in numbers {
                history.push_scan(scan(number));
                history.settle();
            }
        };
        keep(&mut history, 0..3);
        assert!(history.unfiled_bytes() == 0 && history.failure().is_none());
        history.is_full = true;
        keep(&mut history, 3..30);
        let (refused, before) = (history.unfiled_bytes(), history.memory_bytes());
        assert!(refused > 27 * 500, "{refused} bytes");
        assert!(history.failure().is_some_and(|failure| failure.kind() == std::io::ErrorKind::StorageFull));
        history.remove(4);
        assert!(history.unfiled_bytes() < refused);
        // A clone keeps them as well as it can.
        let clone = history.clone();
        history.is_full = false;
        // A few with each thing that the file takes.
        keep(&mut history, 30..31);
        assert!((1..refused).contains(&history.unfiled_bytes()) && history.failure().is_some());
        keep(&mut history, 31..35);
        assert!(history.unfiled_bytes() == 0 && history.failure().is_none());
        assert!(history.memory_bytes() < before);
        for (history, kept) in [(&history, 35), (&clone, 30)] {
            for number in (0..kept).filter(|number| *number != 4) {
                assert!(history.scan(number.into()).unwrap() == scan(number), "{number}");
            }
        }
    }
}
