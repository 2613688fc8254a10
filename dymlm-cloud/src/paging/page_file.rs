use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Result};
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use dymlm_core::ScratchFile;

use super::Record;

/// Lengths in the file are multiples of this, so that what is written later fits into places that became
/// free.
const UNIT: usize = 4096;

/// The file to which blocks are paged out. Places that nobody refers to any more are written over.
#[derive(Debug)]
pub(crate) struct PageFile {
    file: ScratchFile,
    /// Free places, by their length in bytes.
    free: Mutex<BTreeMap<usize, Vec<u64>>>,
    /// Why a block could not be read back, if one is lost.
    failure: OnceLock<ErrorKind>,
}

/// Some blocks in the file. Their place is free again when this is dropped.
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

    /// Writes some blocks, followed by zeros up to a whole unit.
    pub(crate) fn write(self: &Arc<Self>, blocks: &mut Vec<u8>) -> Result<Extent> {
        let length = blocks.len().next_multiple_of(UNIT);
        blocks.resize(length, 0);
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let offset = match free.get_mut(&length).and_then(Vec::pop) {
            Some(offset) => self.file.overwrite(offset, blocks).map(|()| offset),
            None => self.file.append(blocks),
        }?;
        Ok(Extent { file: Arc::clone(self), offset, length })
    }

    /// Why blocks are lost, if any are.
    pub(crate) fn failure(&self) -> Option<Error> {
        self.failure.get().map(|&kind| Error::from(kind))
    }
}

impl Extent {
    /// Reads one of the blocks. A block that cannot be read is empty, and [`PageFile::failure`] gives the
    /// reason from then on.
    pub(crate) fn read<B: Record + Default>(&self, from: u32, length: u32) -> B {
        let bytes = self.file.file.read(self.offset + u64::from(from), length as usize);
        let block = bytes.and_then(|bytes| {
            B::read(&mut bytes.as_slice()).ok_or_else(|| Error::from(ErrorKind::InvalidData))
        });
        block.unwrap_or_else(|error| {
            // Only the first reason is kept.
            let _ = self.file.failure.set(error.kind());
            B::default()
        })
    }
}

impl Drop for Extent {
    fn drop(&mut self) {
        let mut free = self.file.free.lock().unwrap_or_else(PoisonError::into_inner);
        free.entry(self.length).or_default().push(self.offset);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_free_is_written_over_before_the_file_grows() {
        let file = PageFile::create_in(&std::env::temp_dir()).unwrap();
        let write = |byte: u8| file.write(&mut vec![byte; 5000]).unwrap();
        let (first, second) = (write(1), write(2));
        let (place, end) = (first.offset, second.offset + second.length as u64);
        drop(first);
        let (third, fourth) = (write(3), write(4));
        assert_eq!((third.offset, fourth.offset), (place, end));
        assert_eq!([second, third, fourth].map(|extent| extent.read::<u8>(4999, 1)), [2, 3, 4]);
    }

    #[test]
    fn a_block_that_cannot_be_read_is_empty_and_said_to_be_lost() {
        let file = PageFile::create_in(&std::env::temp_dir()).unwrap();
        let beyond = Extent { file: Arc::clone(&file), offset: 1 << 40, length: 8 };
        assert!(file.failure().is_none());
        assert_eq!(beyond.read::<Vec<u32>>(0, 8), Vec::new());
        assert_eq!(file.failure().unwrap().kind(), ErrorKind::UnexpectedEof);
    }
}
