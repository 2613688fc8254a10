//! Putting a new map folder in an old one's place, in an order from which every crash can be recovered.

use std::collections::BTreeSet;
use std::ffi::{OsStr, OsString};
use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::time::Duration;

use tempfile::TempDir;

use super::lock::FolderLock;
use super::manifest::{MANIFEST, Manifest};
use crate::Error;
use crate::write_atomically::{parent_of, sync_folder};

/// How often, and after how long each time, a reader looks again for a map that is just being replaced.
const MOST_LOOKS: usize = 200;
const LOOK_INTERVAL: Duration = Duration::from_millis(5);

/// The folder's own path: links resolved, and without a trailing `.` that would have no name.
pub(super) fn resolve(folder: &Path) -> Result<PathBuf, Error> {
    match fs::canonicalize(folder) {
        Ok(resolved) => Ok(resolved),
        // A link to nothing would be replaced by the folder rather than followed.
        Err(error) if error.kind() == io::ErrorKind::NotFound && !folder.is_symlink() => {
            let Some(name) = folder.file_name() else {
                return Err(Error::malformed(folder, "no name for a folder"));
            };
            let parent = parent_of(folder);
            fs::create_dir_all(&parent).map_err(Error::io(&parent))?;
            let parent = fs::canonicalize(&parent).map_err(Error::io(&parent))?;
            Ok(parent.join(name))
        }
        Err(error) => Err(Error::io(folder)(error)),
    }
}

/// Refuses a target that holds something else than a map.
pub(super) fn check_replaceable(target: &Path) -> Result<(), Error> {
    if !target.exists() || Manifest::marks(target) {
        return Ok(());
    }
    let is_empty = target.is_dir() && names_in(target)?.is_empty();
    if is_empty { Ok(()) } else { Err(Error::InTheWay { path: target.to_path_buf() }) }
}

/// A temporary folder beside the target, with the permissions of an ordinary new folder.
pub(super) fn staging_folder(target: &Path) -> Result<TempDir, Error> {
    let prefix = staging_prefix(target);
    let mut builder = tempfile::Builder::new();
    builder.prefix(&prefix);
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        builder
            .permissions(fs::Permissions::from_mode(0o777))
            .tempdir_in(parent_of(target))
            .map_err(Error::io(target))
    }
    #[cfg(not(unix))]
    builder.tempdir_in(parent_of(target)).map_err(Error::io(target))
}

/// Renames the finished folder to the target. Until the last rename has succeeded, an error puts back what
/// was there.
pub(super) fn put_in_place(staging: TempDir, target: &Path, manifest: &Manifest) -> Result<(), Error> {
    check_replaceable(target)?;
    let aside = aside_path(target);
    let replaces = Manifest::marks(target);
    if replaces {
        check_names_free(target, manifest)?;
        fs::rename(target, &aside).map_err(Error::io(target))?;
    } else if target.exists() {
        // Empty, or this fails.
        fs::remove_dir(target).map_err(Error::io(target))?;
    }
    if let Err(error) = fs::rename(staging.path(), target) {
        if replaces {
            fs::rename(&aside, target).ok();
        }
        return Err(Error::io(target)(error));
    }
    // The folder is the map's from here on, and not to be removed.
    let _ = staging.keep();
    sync_folder(&parent_of(target));
    if replaces {
        // The new map is in place. What cannot be removed of the old one stays aside for the next writer to
        // clear.
        clear_aside(&aside, target).ok();
    }
    Ok(())
}

/// Finishes what a crash left: a map that was put aside is put back when nothing took its place, else cleared
/// away.
pub(super) fn recover(target: &Path) -> Result<(), Error> {
    let aside = aside_path(target);
    if !aside.exists() {
        return Ok(());
    }
    if Manifest::marks(target) {
        return clear_aside(&aside, target);
    }
    if target.exists() {
        // An empty folder made since; anything else is left alone.
        fs::remove_dir(target).map_err(|_| Error::InTheWay { path: target.to_path_buf() })?;
    }
    fs::rename(&aside, target).map_err(Error::io(&aside))?;
    sync_folder(&parent_of(target));
    Ok(())
}

/// The same for a reader: while somebody writes the map, it is away between two renames only.
pub(super) fn recover_unless_written(target: &Path) -> Result<(), Error> {
    let is_away = || aside_path(target).exists() && !target.exists();
    for _ in 0..MOST_LOOKS {
        if !is_away() {
            return Ok(());
        }
        match FolderLock::take(target) {
            Ok(_lock) => return recover(target),
            Err(Error::Locked { .. }) => std::thread::sleep(LOOK_INTERVAL),
            // Where nothing can be locked, as in a folder that is read-only, nobody writes.
            Err(_) => return recover(target),
        }
    }
    Err(Error::Locked { path: target.to_path_buf() })
}

/// Removes what writers left that were killed; what cannot be removed stays.
pub(super) fn remove_stale_staging(target: &Path) {
    let prefix = staging_prefix(target);
    let Ok(entries) = fs::read_dir(parent_of(target)) else { return };
    for entry in entries.flatten() {
        let name = entry.file_name();
        if name.as_encoded_bytes().starts_with(prefix.as_encoded_bytes()) && entry.path().is_dir() {
            fs::remove_dir_all(entry.path()).ok();
        }
    }
}

fn staging_prefix(target: &Path) -> OsString {
    let mut prefix = hidden_name(target, "-new");
    prefix.push("-");
    prefix
}

/// Refuses to replace a map in whose folder someone put files under names that the new map needs.
fn check_names_free(target: &Path, manifest: &Manifest) -> Result<(), Error> {
    let foreign = foreign_names(target)?;
    match manifest.files.iter().find(|file| foreign.contains(OsStr::new(&file.name))) {
        Some(file) => Err(Error::InTheWay { path: target.join(&file.name) }),
        None => Ok(()),
    }
}

/// Moves files that are not the old map's to the new folder and removes the old map. Nothing but the old
/// map's own files is ever deleted.
fn clear_aside(aside: &Path, target: &Path) -> Result<(), Error> {
    for name in foreign_names(aside)? {
        let to = target.join(&name);
        if !to.exists() {
            fs::rename(aside.join(&name), to).map_err(Error::io(aside))?;
        }
    }
    // The manifest goes last: as long as it is there, the other files are known to be the map's.
    for name in Manifest::file_names(aside).into_iter().chain([MANIFEST.to_owned()]) {
        let path = aside.join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(Error::io(&path)(error)),
            _ => {}
        }
    }
    fs::remove_dir(aside).map_err(Error::io(aside))
}

/// Names in a map's folder that are not the map's.
fn foreign_names(folder: &Path) -> Result<BTreeSet<OsString>, Error> {
    let mut names = names_in(folder)?;
    names.remove(OsStr::new(MANIFEST));
    for own in Manifest::file_names(folder) {
        names.remove(OsStr::new(&own));
    }
    Ok(names)
}

fn names_in(folder: &Path) -> Result<BTreeSet<OsString>, Error> {
    let entries = fs::read_dir(folder).map_err(Error::io(folder))?;
    entries.map(|entry| Ok(entry?.file_name())).collect::<io::Result<_>>().map_err(Error::io(folder))
}

/// Where an old map waits while the new one takes its place.
fn aside_path(target: &Path) -> PathBuf {
    target.with_file_name(hidden_name(target, "-old"))
}

pub(super) fn hidden_name(target: &Path, suffix: &str) -> OsString {
    let mut name = OsString::from(".");
    name.push(target.file_name().unwrap_or(OsStr::new("map")));
    name.push(".dymlm");
    name.push(suffix);
    name
}
