use std::fs;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::Error;

/// Writes a file completely or not at all: under a temporary name in the same folder, flushed to the disk,
/// then renamed. An older file of that name stays as it is until the new one is complete. A symbolic link is
/// followed. A pipe or a device, such as `/dev/null`, is written to as it is.
///
/// # Errors
///
/// [`Error::Io`] when the folder cannot be written; [`Error::Content`] when `write` fails. Either way no
/// temporary file is left behind and nothing is changed; only what has gone into a pipe stays there.
///
/// ```
/// # let folder = tempfile::tempdir()?;
/// let path = folder.path().join("numbers.txt");
/// dymlm_io::write_atomically(&path, |out| writeln!(out, "1 2 3"))?;
/// assert_eq!(std::fs::read_to_string(&path)?, "1 2 3\n");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write_atomically<E>(
    path: impl AsRef<Path>,
    write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<(), Error>
where
    E: Into<Box<dyn std::error::Error + Send + Sync>>,
{
    let path = path.as_ref();
    let failed = |source: E| Error::Content { path: path.to_path_buf(), source: source.into() };
    // Whoever reads the other end of a pipe would never hear of a file that takes the pipe's place.
    if fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        let mut out = BufWriter::new(fs::File::create(path).map_err(Error::io(path))?);
        write(&mut out).map_err(failed)?;
        return out.flush().map_err(Error::io(path));
    }
    // Renaming replaces a link itself, and whoever reads what it leads to would never see the new file.
    let target = followed(path);
    let folder = parent_of(&target);
    let file = named_temporary(&folder).map_err(Error::io(path))?;
    let mut out = BufWriter::with_capacity(1 << 16, file);
    write(&mut out).map_err(failed)?;
    let file = out.into_inner().map_err(|error| Error::io(path)(error.into_error()))?;
    file.as_file().sync_all().map_err(Error::io(path))?;
    file.persist(&target).map_err(|error| Error::io(path)(error.error))?;
    sync_folder(&folder);
    Ok(())
}

/// Links that are followed, one leading to the next, at most.
const MOST_LINKS: usize = 40;

/// Where a path leads, also through links to a file that is not there yet.
fn followed(path: &Path) -> PathBuf {
    let mut target = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&target) else { break };
        // A relative link begins in its own folder.
        target = parent_of(&target).join(next);
    }
    fs::canonicalize(&target).unwrap_or(target)
}

/// The parent folder of a path; `.` for a bare name.
pub(crate) fn parent_of(path: &Path) -> PathBuf {
    match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent.to_path_buf(),
        _ => PathBuf::from("."),
    }
}

/// A temporary file with the permissions of an ordinary new file. Without them, the file would be readable by
/// its owner alone, even after the rename.
fn named_temporary(folder: &Path) -> std::io::Result<NamedTempFile> {
    let mut builder = tempfile::Builder::new();
    builder.prefix(".dymlm-");
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder.permissions(fs::Permissions::from_mode(0o666)).tempfile_in(folder)
    }
    #[cfg(not(unix))]
    builder.tempfile_in(folder)
}

/// Flushes `folder`, so that a rename in it survives a power cut. Errors are ignored: not every file system
/// can flush folders, and the rename itself is done.
pub(crate) fn sync_folder(folder: &Path) {
    if let Ok(opened) = fs::File::open(folder) {
        opened.sync_all().ok();
    }
}
