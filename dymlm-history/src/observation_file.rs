use std::fs::{File, OpenOptions};
use std::io::{Error as IoError, ErrorKind, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use crate::Error;

/// Names tried before giving up: other sessions' files may be in the folder.
const MOST_NAMES: u32 = 10_000;

/// A file that only grows, and that goes with its owner: where the system allows it, it has no name from the
/// beginning, so that not even a crash leaves it.
#[derive(Debug)]
pub(crate) struct ObservationFile {
    file: Mutex<Contents>,
    /// Its name, where one had to stay.
    path: Option<PathBuf>,
}

#[derive(Debug)]
struct Contents {
    file: File,
    end: u64,
}

impl ObservationFile {
    pub(crate) fn create_in(folder: &Path) -> Result<Self, Error> {
        let create = |path: &Path| OpenOptions::new().read(true).write(true).create_new(true).open(path);
        for number in 0..MOST_NAMES {
            let path = folder.join(format!("dymlm-history-{}-{number}.bin", std::process::id()));
            match create(&path) {
                Ok(file) => {
                    let path = std::fs::remove_file(&path).is_err().then_some(path);
                    return Ok(Self { file: Mutex::new(Contents { file, end: 0 }), path });
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(source) => return Err(Error::Create { folder: folder.into(), source }),
            }
        }
        Err(Error::Create { folder: folder.into(), source: ErrorKind::AlreadyExists.into() })
    }

    /// Writes bytes behind the others; gives where they begin. What fails is written over by the next.
    pub(crate) fn append(&self, bytes: &[u8]) -> Result<u64, IoError> {
        let mut contents = self.locked();
        let Contents { file, end } = &mut *contents;
        let begin = *end;
        file.seek(SeekFrom::Start(begin))?;
        file.write_all(bytes)?;
        *end = begin + bytes.len() as u64;
        Ok(begin)
    }

    pub(crate) fn read(&self, offset: u64, length: usize) -> Result<Vec<u8>, IoError> {
        let mut bytes = vec![0; length];
        let mut contents = self.locked();
        contents.file.seek(SeekFrom::Start(offset))?;
        contents.file.read_exact(&mut bytes)?;
        Ok(bytes)
    }

    fn locked(&self) -> MutexGuard<'_, Contents> {
        // Every use seeks first.
        self.file.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for ObservationFile {
    fn drop(&mut self) {
        if let Some(path) = &self.path {
            // Nobody can be told.
            let _ = std::fs::remove_file(path);
        }
    }
}
