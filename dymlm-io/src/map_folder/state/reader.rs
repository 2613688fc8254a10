use std::collections::BTreeMap;
use std::collections::btree_map::{Entry, IntoIter};
use std::io;
use std::path::{Path, PathBuf};

use dymlm_core::DamagedState;

use super::index::{Part, StateIndex};
use super::segment::SegmentReader;
use super::{INDEX, segment_name};
use crate::{Error, MapFolder};

/// A part of a saved state that cannot be read, or has changed since it was written.
#[derive(Debug, thiserror::Error)]
#[error("part {part:#x} of {section}, in {}: {source}", path.display())]
pub struct DamagedPart {
    /// The section.
    pub section: String,
    /// The part's key.
    pub part: u64,
    /// The segment file that holds the part.
    pub path: PathBuf,
    /// What is wrong.
    pub source: io::Error,
}

impl MapFolder {
    /// Whether the folder holds a state beside the standard files.
    pub fn has_state(&self) -> bool {
        self.files().any(|file| file == INDEX)
    }

    /// The parts of a section of the state, each with its key and bytes, by ascending key; no parts when
    /// there is no such section.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] when the folder holds no state, or its index is damaged; [`Error::Io`].
    pub fn state(&self, section: &str) -> Result<StateParts, Error> {
        let parts = self.state_index()?.sections.remove(section).unwrap_or_default();
        let folder = self.path(INDEX)?.parent().unwrap_or(Path::new("")).to_path_buf();
        Ok(StateParts {
            section: section.to_owned(),
            folder,
            parts: parts.into_iter(),
            segments: BTreeMap::new(),
        })
    }

    /// Where the parts of the state are. Read once, so that all sections are those of one save.
    pub(super) fn state_index(&self) -> Result<StateIndex, Error> {
        if let Some(index) = self.index.get() {
            return Ok(StateIndex::clone(index));
        }
        let (path, bytes) = (self.path(INDEX)?, self.read(INDEX)?);
        if !self.is_as_listed(INDEX, &bytes) {
            let reason = "not as the manifest says: damaged, or replaced since the map was opened";
            return Err(Error::malformed(&path, reason));
        }
        let index =
            StateIndex::decode(&bytes).map_err(|DamagedState { what, .. }| Error::malformed(&path, what))?;
        Ok(self.index.get_or_init(|| index).clone())
    }
}

/// Iterates over the parts of a [section](MapFolder::state). After a damaged part, the others still follow.
#[derive(Debug)]
pub struct StateParts {
    section: String,
    folder: PathBuf,
    parts: IntoIter<u64, Part>,
    /// The segments opened so far.
    segments: BTreeMap<u32, SegmentReader>,
}

impl Iterator for StateParts {
    type Item = Result<(u64, Vec<u8>), DamagedPart>;

    fn next(&mut self) -> Option<Self::Item> {
        let (key, part) = self.parts.next()?;
        let path = self.folder.join(segment_name(part.segment));
        let read = self.read(&path, &part);
        Some(match read {
            Ok(bytes) => Ok((key, bytes)),
            Err(source) => Err(DamagedPart { section: self.section.clone(), part: key, path, source }),
        })
    }
}

impl StateParts {
    fn read(&mut self, path: &Path, part: &Part) -> io::Result<Vec<u8>> {
        let segment = match self.segments.entry(part.segment) {
            Entry::Occupied(opened) => opened.into_mut(),
            Entry::Vacant(place) => place.insert(SegmentReader::open(path)?),
        };
        segment.read(part)
    }
}
