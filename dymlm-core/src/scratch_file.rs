use std::fs::{File, OpenOptions};
use std::io::{Error, ErrorKind, Result};
#[cfg(not(unix))]
use std::io::{Read, Seek, SeekFrom, Write};
#[cfg(unix)]
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Names tried before giving up: files of other processes may be in the folder.
const MOST_NAMES: u32 = 10_000;

/// A file for data that do not fit into memory, which is removed with its owner. Where the system allows it,
/// the file loses its name at once, so that not even a crash leaves it behind.
#[derive(Debug)]
pub struct ScratchFile {
    file: Mutex<Contents>,
    /// The file's path, where its name had to stay.
    path: Option<PathBuf>,
}

#[derive(Debug)]
struct Contents {
    file: File,
    end: u64,
}

impl ScratchFile {
    /// An empty file in a folder that exists; `purpose` is a part of its name, as long as it has one.
    ///
    /// # Errors
    ///
    /// Those of making a file there.
    pub fn create_in(folder: &Path, purpose: &str) -> Result<Self> {
        let create = |path: &Path| OpenOptions::new().read(true).write(true).create_new(true).open(path);
        for number in 0..MOST_NAMES {
            let path = folder.join(format!("dymlm-{purpose}-{}-{number}.bin", std::process::id()));
            match create(&path) {
                Ok(file) => {
                    let path = std::fs::remove_file(&path).is_err().then_some(path);
                    return Ok(Self { file: Mutex::new(Contents { file, end: 0 }), path });
                }
                Err(error) if error.kind() == ErrorKind::AlreadyExists => {}
                Err(error) => return Err(error),
            }
        }
        Err(ErrorKind::AlreadyExists.into())
    }

    /// Writes bytes after the others; returns where they begin. Bytes of a failed call are overwritten by the
    /// next.
    ///
    /// # Errors
    ///
    /// Those of writing: a full disk, say.
    pub fn append(&self, bytes: &[u8]) -> Result<u64> {
        let mut contents = self.locked();
        let begin = contents.end;
        contents.write(begin, bytes)?;
        contents.end = begin + bytes.len() as u64;
        Ok(begin)
    }

    /// Writes bytes over others.
    ///
    /// # Errors
    ///
    /// Those of writing; nothing is written beyond the end.
    pub fn overwrite(&self, offset: u64, bytes: &[u8]) -> Result<()> {
        let mut contents = self.locked();
        if offset.saturating_add(bytes.len() as u64) > contents.end {
            return Err(Error::from(ErrorKind::InvalidInput));
        }
        contents.write(offset, bytes)
    }

    /// Reads `length` bytes from an offset on.
    ///
    /// # Errors
    ///
    /// Those of reading, also when there are fewer bytes.
    pub fn read(&self, offset: u64, length: usize) -> Result<Vec<u8>> {
        let mut bytes = vec![0; length];
        self.locked().read(offset, &mut bytes)?;
        Ok(bytes)
    }

    fn locked(&self) -> MutexGuard<'_, Contents> {
        // A poisoned lock does no harm: every use names its place.
        self.file.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Where the system has one call for it: parts that are read are small, so that each call counts.
#[cfg(unix)]
impl Contents {
    fn write(&mut self, offset: u64, bytes: &[u8]) -> Result<()> {
        self.file.write_all_at(bytes, offset)
    }

    fn read(&mut self, offset: u64, bytes: &mut [u8]) -> Result<()> {
        self.file.read_exact_at(bytes, offset)
    }
}

#[cfg(not(unix))]
impl Contents {
    fn write(&mut self, offset: u64, bytes: &[u8]) -> Result<()> {
        self.file.seek(SeekFrom::Start(offset))?;
        self.file.write_all(bytes)
    }

    fn read(&mut self, offset: u64, bytes: &mut [u8]) -> Result<()> {
        self.file.seek(SeekFrom::Start(offset))?;
        self.file.read_exact(bytes)
    }
}

impl Drop for ScratchFile {
    fn drop(&mut self) {
        if let Some(path) = &self.path {
            // A failure cannot be reported here.
            let _ = std::fs::remove_file(path);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_are_read_back_and_nothing_is_left_in_the_folder() {
        let folder = std::env::temp_dir().join(format!("dymlm-scratch-file-{}", std::process::id()));
        std::fs::create_dir_all(&folder).unwrap();
        let file = ScratchFile::create_in(&folder, "test").unwrap();
        assert_eq!([file.append(b"first").unwrap(), file.append(b"second").unwrap()], [0, 5]);
        file.overwrite(0, b"third").unwrap();
        assert_eq!(file.read(0, 11).unwrap(), b"thirdsecond");
        assert!(file.overwrite(7, b"beyond").is_err() && file.read(5, 7).is_err());
        assert!(ScratchFile::create_in(&folder.join("none"), "test").is_err());
        drop(file);
        assert_eq!(std::fs::read_dir(&folder).unwrap().count(), 0);
        std::fs::remove_dir(&folder).unwrap();
    }
}
