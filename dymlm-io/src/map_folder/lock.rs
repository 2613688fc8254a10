use std::fs::{File, OpenOptions, TryLockError};
use std::io;
use std::path::{Path, PathBuf};

use super::replace::{hidden_name, remove_stale_staging};
use crate::Error;

/// A lock on the map of a folder: only its holder writes that map, in this process or any other. The system
/// releases it when the process ends, however it ends.
#[derive(Debug)]
pub(super) struct FolderLock {
    path: PathBuf,
    /// Locked as long as the file is open.
    _file: File,
}

impl FolderLock {
    /// Locks the map of a resolved folder, and removes temporary folders that killed writers left.
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
            // The last holder may have removed the file after it was opened here: then somebody else could
            // lock a new file of the same name.
            if is_still_there(&path, &file) {
                remove_stale_staging(target);
                return Ok(Self { path, _file: file });
            }
        }
    }
}

impl Drop for FolderLock {
    fn drop(&mut self) {
        // Removed while it is still locked. A file that cannot be removed does no harm.
        std::fs::remove_file(&self.path).ok();
    }
}

/// Whether the path still leads to this open file.
#[cfg(unix)]
fn is_still_there(path: &Path, file: &File) -> bool {
    use std::os::unix::fs::MetadataExt;
    let identity = |metadata: io::Result<std::fs::Metadata>| {
        metadata.map(|metadata| (metadata.dev(), metadata.ino())).ok()
    };
    identity(file.metadata()) == identity(std::fs::metadata(path))
}

/// Other systems do not remove open files.
#[cfg(not(unix))]
fn is_still_there(path: &Path, _file: &File) -> bool {
    path.exists()
}
