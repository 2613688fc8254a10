use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use dymlm_core::StateSink;
use serde::Serialize;

use super::index::{Part, StateIndex};
use super::segment::{SegmentReader, SegmentWriter};
use super::{INDEX, segment_name};
use crate::map_folder::lock::FolderLock;
use crate::map_folder::replace::resolve;
use crate::{Error, MapFolder, MapFolderWriter};

/// Saves maps into one folder again and again. Each save writes only the parts that have changed.
///
/// As long as the saver lives, nobody else can write the folder. A save that fails or is killed leaves the
/// previous map in place: see [`MapFolderWriter`].
///
/// ```
/// # let parent = tempfile::tempdir()?;
/// # let folder = parent.path().join("map");
/// use dymlm_io::{MapFolder, MapFolderSaver};
///
/// let mut saver = MapFolderSaver::create(&folder)?;
/// saver.save(&"config", &2, |_, state| {
///     state.section("numbers", |part| {
///         part(1, Some(b"one"))?;
///         part(2, Some(b"two"))
///     })
/// })?;
/// // The first part is not written again.
/// saver.save(&"config", &2, |_, state| state.section("numbers", |part| part(2, Some(b"zwei"))))?;
///
/// let parts = MapFolder::open(&folder)?.state("numbers")?;
/// let parts: Vec<_> = parts.collect::<Result<_, _>>()?;
/// assert_eq!(parts, [(1, b"one".to_vec()), (2, b"zwei".to_vec())]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct MapFolderSaver {
    target: PathBuf,
    /// The parts in the folder that this saver knows of.
    index: StateIndex,
    /// Whether the last save has found some of the parts before it damaged.
    is_damaged: bool,
    _lock: FolderLock,
}

impl MapFolderSaver {
    /// A saver that ignores what the folder holds: its first save replaces everything.
    ///
    /// # Errors
    ///
    /// [`Error::Locked`] when somebody else writes the folder; [`Error::InTheWay`] when something stands
    /// there that is neither a map nor empty; [`Error::Io`].
    pub fn create(folder: impl AsRef<Path>) -> Result<Self, Error> {
        let target = resolve(folder.as_ref())?;
        let lock = FolderLock::take(&target)?;
        MapFolderWriter::check(&target)?;
        Ok(Self { target, index: StateIndex::default(), is_damaged: false, _lock: lock })
    }

    /// A saver that continues from what the folder holds: its first save writes only what differs. Also
    /// returns the folder, to be read.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] when there is no such folder: none is made. [`Error::Locked`] when somebody else writes
    /// the folder; those of [`MapFolder::open`] and [`MapFolder::state`].
    pub fn open(folder: impl AsRef<Path>) -> Result<(Self, MapFolder), Error> {
        let folder = folder.as_ref();
        if !folder.exists() {
            // A crash may have left the map aside: it is put back, or the folder is named as missing.
            MapFolder::open_unverified(folder)?;
        }
        let saver = Self::create(folder)?;
        let saved = MapFolder::open(&saver.target)?;
        Ok((Self { index: saved.state_index()?, ..saver }, saved))
    }

    /// The map's folder.
    pub fn folder(&self) -> &Path {
        &self.target
    }

    /// Saves the map: `write` writes all standard files, and those parts of the state that have changed since
    /// the last save. The other parts are kept.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] when the folder is no longer [as it was left](Self::is_as_left); those of
    /// `write`, and of [`MapFolderWriter`]. The last saved map is still there then. Older parts that turn out
    /// to be damaged are kept as they are: what is new is saved all the same.
    pub fn save<C, N>(
        &mut self,
        config: &C,
        counts: &N,
        write: impl FnOnce(&mut MapFolderWriter, &mut StateWriter) -> Result<(), Error>,
    ) -> Result<(), Error>
    where
        C: Serialize + ?Sized,
        N: Serialize + ?Sized,
    {
        if !self.is_as_left() {
            let reason = "what was saved has been removed, replaced or damaged: all parts must be saved anew";
            return Err(Error::malformed(&self.target, reason));
        }
        let mut folder = MapFolderWriter::begin(&self.target)?;
        let mut state = StateWriter::begin(&self.target, folder.staging(), &self.index)?;
        write(&mut folder, &mut state)?;
        let (number, index, is_damaged) = state.finish()?;
        for (&segment, &bytes) in &index.segments {
            if segment == number {
                folder.add(&segment_name(segment), bytes);
            } else {
                folder.keep(&segment_name(segment), bytes)?;
            }
        }
        let bytes = index.encode().map_err(Error::io(&self.target))?;
        folder.file(INDEX, |out| out.write_all(&bytes))?;
        folder.finish(config, counts)?;
        (self.index, self.is_damaged) = (index, is_damaged);
        Ok(())
    }

    /// Whether the folder still holds the parts that this saver has saved or opened last: a lock keeps other
    /// savers away, but nobody who removes the folder or puts a copy of another in its place, and a disk may
    /// fail, which a save notices that reads older parts. Then [`forget`](Self::forget) them.
    pub fn is_as_left(&self) -> bool {
        if self.is_damaged {
            return false;
        }
        if self.index.segments.is_empty() {
            return true;
        }
        let Ok(index) = self.index.encode() else { return false };
        let is_there = |(&number, &bytes): (&u32, &u64)| {
            fs::metadata(self.target.join(segment_name(number))).is_ok_and(|found| found.len() == bytes)
        };
        self.index.segments.iter().all(is_there)
            && fs::read(self.target.join(INDEX)).is_ok_and(|found| found == index)
    }

    /// Forgets the saved parts: the next save must be given all parts, and keeps no others.
    pub fn forget(&mut self) {
        (self.index, self.is_damaged) = (StateIndex::default(), false);
    }
}

/// Receives the parts of a state that is being saved.
#[derive(Debug)]
pub struct StateWriter {
    target: PathBuf,
    segment: SegmentWriter,
    index: StateIndex,
    /// Whether a segment was found to have changed since it was written.
    is_damaged: bool,
}

impl StateWriter {
    fn begin(target: &Path, staging: &Path, before: &StateIndex) -> Result<Self, Error> {
        let number = before.segments.last_key_value().map_or(1, |(last, _)| last.saturating_add(1));
        let path = staging.join(segment_name(number));
        let segment = SegmentWriter::create(&path, number).map_err(Error::io(target))?;
        Ok(Self { target: target.to_path_buf(), segment, index: before.clone(), is_damaged: false })
    }

    /// Changes a section: each part that `write` gives replaces the part of the same key; `None` removes that
    /// part. Parts are deflated where that makes them smaller.
    ///
    /// # Errors
    ///
    /// [`Error::Io`], also where `write` fails.
    pub fn section(
        &mut self,
        name: &str,
        write: impl FnOnce(&mut StateSink<'_>) -> io::Result<()>,
    ) -> Result<(), Error> {
        self.change(name, SegmentWriter::deflate, write)
    }

    /// As [`section`](Self::section), for parts that are compressed already: they are written as they are,
    /// since to try and deflate them takes longer than all else.
    ///
    /// # Errors
    ///
    /// Those of [`section`](Self::section).
    pub fn packed_section(
        &mut self,
        name: &str,
        write: impl FnOnce(&mut StateSink<'_>) -> io::Result<()>,
    ) -> Result<(), Error> {
        self.change(name, SegmentWriter::write, write)
    }

    fn change(
        &mut self,
        name: &str,
        append: impl Fn(&mut SegmentWriter, &[u8]) -> io::Result<Part>,
        write: impl FnOnce(&mut StateSink<'_>) -> io::Result<()>,
    ) -> Result<(), Error> {
        let Self { target, segment, index, .. } = self;
        let parts = index.sections.entry(name.to_owned()).or_default();
        let mut sink = |key, bytes: Option<&[u8]>| {
            match bytes {
                Some(bytes) => parts.insert(key, append(segment, bytes)?),
                None => parts.remove(&key),
            };
            Ok(())
        };
        write(&mut sink).map_err(Error::io(target))
    }

    /// Copies parts out of segments that are not worth keeping; returns the new segment's number, the new
    /// index, and whether a segment was found damaged.
    fn finish(mut self) -> Result<(u32, StateIndex, bool), Error> {
        for number in self.index.to_be_folded(self.segment.end()) {
            match self.fold(number) {
                Ok(()) => _ = self.index.segments.remove(&number),
                // It is kept as it is, so that what is new is saved all the same.
                Err(error) if is_damage(&error) => self.is_damaged = true,
                Err(error) => return Err(Error::io(&self.target.join(segment_name(number)))(error)),
            }
        }
        let number = self.segment.number();
        let bytes = self.segment.finish().map_err(Error::io(&self.target))?;
        self.index.segments.insert(number, bytes);
        Ok((number, self.index, self.is_damaged))
    }

    /// Copies the parts in use of a segment to the new segment.
    fn fold(&mut self, number: u32) -> io::Result<()> {
        let Self { target, segment, index, .. } = self;
        let mut reader = None;
        let parts = index.sections.values_mut().flat_map(BTreeMap::values_mut);
        let mut parts: Vec<&mut Part> = parts.filter(|part| part.segment == number).collect();
        parts.sort_unstable_by_key(|part| part.offset);
        for part in parts {
            let reader = match &mut reader {
                Some(reader) => reader,
                None => reader.insert(SegmentReader::open(&target.join(segment_name(number)))?),
            };
            *part = segment.copy(part, &reader.packed(part)?)?;
        }
        Ok(())
    }
}

/// Whether a part that was read is not what was written.
fn is_damage(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof)
}
