use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use super::replace::{hidden_name, remove_stale_staging};
use crate::Error;

/// Whoever holds it is the only one who writes the map of a folder, in this process or any other. The system
/// lets go of it when the process ends, however it ends.
#[derive(Debug)]
pub(super) struct FolderLock {
    path: PathBuf,
    /// Locked as long as it is open.
    _file: File,
}

impl FolderLock {
    /// Locks the map of a resolved folder, and clears away what writers left that were killed.
    pub(super) fn take(target: &Path) -> Result<Self, Error> {
        let path = target.with_file_name(hidden_name(target, "-lock"));
        loop {
            let mut options = OpenOptions::new();
            let file =
                options.create(true).truncate(false).write(true).open(&path).map_err(Error::io(target))?;
            match file.try_lock() {
                Ok(()) => {}
                Err(TryLockError::WouldBlock) => return Err(Error::Locked { path: target.to_path_buf() }),
                Err(TryLockError::Error(source)) => return Err(Error::io(&path)(source)),
            }
            // Whoever had it may have removed it since it was opened here: then somebody else can lock
            // another.
            if is_still_there(&path, &file) {
                remove_stale_staging(target);
                return Ok(Self { path, _file: file });
            }
        }
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // While it is still locked. What cannot be removed is in nobody's way.
        std::fs::remove_file(&self.path).ok();
    }
}

/// Whether a path leads to an open file.
#[cfg(unix)]
fn is_still_there(path: &Path, file: &File) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |metadata: io::Result<std::fs::Metadata>| {
        metadata.map(|metadata| (metadata.dev(), metadata.ino())).ok()
    };
    identity(file.metadata()) == identity(std::fs::metadata(path))
}

/// Elsewhere open files are not removed.
#[cfg(not(unix))]
fn is_still_there(path: &Path, _file: &File) -> bool {
    path.exists()
}
