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
    /// In a file without a name in this folder, which must exist; the file is deleted with the history.
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
}

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
        Ok(Some(Self { slots: Pages::default(), packer: Packer::default(), file }))
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
        Self { slots: Pages::default(), packer: Packer::default(), file: self.file.clone() }
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
            place => self.put_away(other.read(index, place)?.to_vec().into()),
        };
        self.slots.push(Slot { identity, place });
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
        if let Some(slot) = self.slots.get_mut(index) {
            slot.place = Place::Removed;
        }
    }

    /// Bytes in memory, without what is still being packed, and the buffers of packing.
    pub fn memory_bytes(&self) -> usize {
        let packed = self.slots.iter().map(|slot| match &slot.place {
            Place::Packed(packed) => packed.len(),
            _ => 0,
        });
        packed.sum::<usize>() + self.slots.memory_bytes()
    }

    /// Waits until everything is packed.
    pub fn settle(&mut self) {
        self.packer.finish();
        self.take_packed();
    }

    /// Puts what has been packed into its slot. What cannot be written to the file stays in memory.
    fn take_packed(&mut self) {
        while let Some((index, packed)) = self.packer.next() {
            let is_awaited = matches!(self.place(index), Some(Place::Whole(_)));
            let place = is_awaited.then(|| self.put_away(packed));
            if let Some((slot, place)) = self.slots.get_mut(index).zip(place)
                && let Place::Whole(kept) = std::mem::replace(&mut slot.place, place)
            {
                self.packer.recycle(kept);
            }
        }
    }

    /// Puts packed bytes into the file; without a file, or if it cannot be written, they stay in memory.
    pub(crate) fn put_away(&self, packed: Box<[u8]>) -> Place {
        match self.file.as_ref().and_then(|file| file.append(&packed).ok()) {
            Some(offset) => Place::Filed { offset, length: packed.len() },
            None => Place::Packed(packed.into()),
        }
    }
}
