use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Result};
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use dymlm_core::ScratchFile;

use super::Record;

/// Lengths in the file are multiples of this, so that what becomes free fits what comes.
const UNIT: usize = 256;

/// The file to which blocks are paged out. What nobody holds any more is written over.
#[derive(Debug)]
pub(crate) struct PageFile {
    file: ScratchFile,
    /// Where as many units as the key says are free.
    free: Mutex<BTreeMap<usize, Vec<u64>>>,
    /// Why a block could not be read back: it is lost.
    failure: OnceLock<ErrorKind>,
}

/// A block in the file. Its place is free again when it is dropped.
#[derive(Debug)]
pub(crate) struct Extent {
    file: Arc<PageFile>,
    offset: u64,
    length: usize,
}

impl PageFile {
    pub(crate) fn create_in(folder: &Path) -> Result<Arc<Self>> {
        let file = ScratchFile::create_in(folder, "pages")?;
        Ok(Arc::new(Self { file, free: Mutex::default(), failure: OnceLock::new() }))
    }

    /// Writes a block; `buffer` is used for it.
    pub(crate) fn write(self: &Arc<Self>, block: &impl Record, buffer: &mut Vec<u8>) -> Result<Extent> {
        buffer.clear();
        block.write(buffer);
        let length = buffer.len();
        buffer.resize(length.next_multiple_of(UNIT), 0);
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let offset = match free.get_mut(&buffer.len()).and_then(Vec::pop) {
            Some(offset) => self.file.overwrite(offset, buffer).map(|()| offset),
            None => self.file.append(buffer),
        }?;
        Ok(Extent { file: Arc::clone(self), offset, length })
    }

    /// Why blocks are lost, if any is.
    pub(crate) fn failure(&self) -> Option<Error> {
        self.failure.get().map(|&kind| Error::from(kind))
    }
}

impl Extent {
    /// The block. One that cannot be read is empty, and the file [says so](PageFile::failure) from then on.
    pub(crate) fn read<B: Record + Default>(&self) -> B {
        let bytes = self.file.file.read(self.offset, self.length);
        let block = bytes.and_then(|bytes| {
            B::read(&mut bytes.as_slice()).ok_or_else(|| Error::from(ErrorKind::InvalidData))
        });
        block.unwrap_or_else(|error| {
            // The first reason stays.
            let _ = self.file.failure.set(error.kind());
            B::default()
        })
    }
}

impl Drop for Extent {
    fn drop(&mut self) {
        let mut free = self.file.free.lock().unwrap_or_else(PoisonError::into_inner);
        free.entry(self.length.next_multiple_of(UNIT)).or_default().push(self.offset);
    }
}
