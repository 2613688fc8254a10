use std::collections::BTreeMap;
use std::io::{Error, ErrorKind, Result};
use std::path::Path;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::Record;
use crate::ScratchFile;

/// Lengths in the file are multiples of this, so that what is written later fits into places that became
/// free.
const UNIT: usize = 4096;

/// A file to which parts of maps go that are not needed for now. Places that nobody refers to any more are written
/// over. The file has no name where the system allows that, and is deleted with its last owner.
#[derive(Debug)]
pub struct PageFile {
    file: ScratchFile,
    /// Free places, by their length in bytes.
    free: Mutex<BTreeMap<usize, Vec<u64>>>,
    /// Why a block could not be read back, if one is lost.
    failure: OnceLock<ErrorKind>,
}

/// Some blocks in a [`PageFile`]. Their place is free again when this is dropped.
#[derive(Debug)]
pub struct Extent {
    file: Arc<PageFile>,
    offset: u64,
    length: usize,
}

impl PageFile {
    /// An empty file in a folder that exists.
    ///
    /// # Errors
    ///
    /// Those of making a file there, with the folder's name.
    pub fn create_in(folder: &Path) -> Result<Arc<Self>> {
        let named = |error: Error| Error::new(error.kind(), format!("{}: {error}", folder.display()));
        let file = ScratchFile::create_in(folder, "pages").map_err(named)?;
        Ok(Arc::new(Self { file, free: Mutex::default(), failure: OnceLock::new() }))
    }

    /// Writes some blocks, followed by zeros up to a whole unit, which are appended to `blocks` as well.
    ///
    /// # Errors
    ///
    /// Those of writing: a full disk, say.
    pub fn write(self: &Arc<Self>, blocks: &mut Vec<u8>) -> Result<Extent> {
        let length = blocks.len().next_multiple_of(UNIT);
        blocks.resize(length, 0);
        let mut free = self.free.lock().unwrap_or_else(PoisonError::into_inner);
        let free = free.entry(length).or_default();
        let offset = match free.last() {
            Some(&offset) => {
                self.file.overwrite(offset, blocks)?;
                free.pop();
                offset
            }
            None => self.file.append(blocks)?,
        };
        Ok(Extent { file: Arc::clone(self), offset, length })
    }

    /// Why blocks are lost, if any are.
    pub fn failure(&self) -> Option<Error> {
        self.failure.get().map(|&kind| Error::from(kind))
    }
}

impl Extent {
    /// Reads one of the blocks, which takes `length` bytes from `from` on. A block that cannot be read is empty, and
    /// [`PageFile::failure`] gives the reason from then on.
    pub fn read<B: Record + Default>(&self, from: u32, length: u32) -> B {
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
        assert_eq!(beyond.read::<Vec<u32>>(0, 8), Vec::<u32>::new());
        assert_eq!(file.failure().unwrap().kind(), ErrorKind::UnexpectedEof);
    }
}
