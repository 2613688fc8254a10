//! Puts a new map folder in the place of an old one, in an order of steps that can be recovered from every
//! crash.

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

/// Number of times that a reader looks again for a map that is just being replaced, and the pause before
/// each.
const MOST_LOOKS: usize = 200;
const LOOK_INTERVAL: Duration = Duration::from_millis(5);

/// The folder's own path: links are resolved, and a trailing `.`, which has no name, is removed.
pub(super) fn resolve(folder: &Path) -> Result<PathBuf, Error> {
    match fs::canonicalize(folder) {
        Ok(resolved) => Ok(resolved),
        // A link to a missing folder would be replaced by the new folder rather than followed.
        Err(error) if error.kind() == io::ErrorKind::NotFound && !folder.is_symlink() => {
            let Some(name) = folder.file_name() else {
                return Err(Error::malformed(folder, "the path does not end in a folder's name"));
            };
            let parent = parent_of(folder);
            fs::create_dir_all(&parent).map_err(Error::io(&parent))?;
            let parent = fs::canonicalize(&parent).map_err(Error::io(&parent))?;
            Ok(parent.join(name))
        }
        Err(error) => Err(Error::io(folder)(error)),
    }
}

/// Refuses a target that holds something other than a map, and one that cannot be renamed since a disk is
/// mounted there.
pub(super) fn check_replaceable(target: &Path) -> Result<(), Error> {
    if is_mount_point(target) {
        let reason = "a mount point cannot be replaced by a finished map: name a folder in it";
        return Err(Error::io(target)(io::Error::new(io::ErrorKind::ResourceBusy, reason)));
    }
    if !target.exists() || Manifest::marks(target) {
        return Ok(());
    }
    let is_empty = target.is_dir() && names_in(target)?.is_empty();
    if is_empty { Ok(()) } else { Err(Error::InTheWay { path: target.to_path_buf() }) }
}

/// Whether something is mounted on a folder, as Linux says; other systems are not asked.
fn is_mount_point(folder: &Path) -> bool {
    let Ok(mounts) = fs::read("/proc/self/mountinfo") else { return false };
    let mut escaped = Vec::new();
    for &byte in folder.as_os_str().as_encoded_bytes() {
        match byte {
            b' ' | b'\t' | b'\n' | b'\\' => escaped.extend(format!("\\{byte:03o}").into_bytes()),
            _ => escaped.push(byte),
        }
    }
    // The fifth word of a line is the mount point.
    let mut words = mounts.split(|&byte| byte == b'\n').filter_map(|line| line.split(|&b| b == b' ').nth(4));
    words.any(|word| word == escaped)
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

/// Renames the finished folder to the target. An error before the last rename has succeeded puts back the old
/// map.
pub(super) fn put_in_place(staging: TempDir, target: &Path, manifest: &Manifest) -> Result<(), Error> {
    check_replaceable(target)?;
    let aside = aside_path(target);
    let replaces = Manifest::marks(target);
    if replaces {
        check_names_free(target, manifest)?;
        fs::rename(target, &aside).map_err(Error::io(target))?;
    } else if target.exists() {
        // Removes an empty folder only: otherwise it fails.
        fs::remove_dir(target).map_err(Error::io(target))?;
    }
    if let Err(error) = fs::rename(staging.path(), target) {
        if replaces {
            fs::rename(&aside, target).ok();
        }
        return Err(Error::io(target)(error));
    }
    // From here on the folder is the map, so the temporary folder must not be removed.
    let _ = staging.keep();
    sync_folder(&parent_of(target));
    if replaces {
        // The new map is in place. Remains of the old one that cannot be removed are left for the next
        // writer.
        clear_aside(&aside, target).ok();
    }
    Ok(())
}

/// Finishes a replacement that a crash interrupted: the old map, renamed aside, is put back when nothing took
/// its place, and is removed otherwise.
pub(super) fn recover(target: &Path) -> Result<(), Error> {
    let aside = aside_path(target);
    if !aside.exists() {
        return Ok(());
    }
    if Manifest::marks(target) {
        return clear_aside(&aside, target);
    }
    if target.exists() {
        // An empty folder was made since. Anything else in the way is left alone.
        fs::remove_dir(target).map_err(|_| Error::InTheWay { path: target.to_path_buf() })?;
    }
    fs::rename(&aside, target).map_err(Error::io(&aside))?;
    sync_folder(&parent_of(target));
    Ok(())
}

/// Recovers for a reader that has found no map; returns whether there is one now. It waits while a writer
/// holds the lock: the map is missing only between two renames.
pub(super) fn recover_unless_written(target: &Path) -> Result<bool, Error> {
    for _ in 0..MOST_LOOKS {
        // In this order: a writer that ends in between has left a map.
        if !aside_path(target).exists() || Manifest::marks(target) {
            return Ok(Manifest::marks(target));
        }
        match FolderLock::take(target) {
            Ok(_lock) => return recover(target).map(|()| true),
            Err(Error::Locked { .. }) => std::thread::sleep(LOOK_INTERVAL),
            // Where no lock can be made, as in a read-only folder, nobody writes.
            Err(_) => return recover(target).map(|()| true),
        }
    }
    Err(Error::Locked { path: target.to_path_buf() })
}

/// Removes the temporary folders of killed writers, as far as possible.
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

/// Refuses to replace a map whose folder holds other files under names that the new map needs.
fn check_names_free(target: &Path, manifest: &Manifest) -> Result<(), Error> {
    let foreign = foreign_names(target)?;
    match manifest.files.iter().find(|file| foreign.contains(OsStr::new(&file.name))) {
        Some(file) => Err(Error::InTheWay { path: target.join(&file.name) }),
        None => Ok(()),
    }
}

/// Moves other files in the old map's folder to the new folder, then removes the old map. Nothing but the old
/// map's own files is ever deleted.
fn clear_aside(aside: &Path, target: &Path) -> Result<(), Error> {
    for name in foreign_names(aside)? {
        fs::rename(aside.join(&name), free_path(target, &name)).map_err(Error::io(aside))?;
    }
    // The manifest is removed last: as long as it is there, the other files are known to be the map's.
    for name in Manifest::file_names(aside).into_iter().chain([MANIFEST.to_owned()]) {
        let path = aside.join(name);
        match fs::remove_file(&path) {
            Err(error) if error.kind() != io::ErrorKind::NotFound => return Err(Error::io(&path)(error)),
            _ => {}
        }
    }
    fs::remove_dir(aside).map_err(Error::io(aside))
}

/// Where a folder has room for a file of this name: with a number behind it where somebody has put another
/// since.
fn free_path(folder: &Path, name: &OsStr) -> PathBuf {
    let numbered = (1_u32..).map(|number| {
        let mut name = name.to_owned();
        name.push(format!(".{number}"));
        name
    });
    let mut paths = std::iter::once(name.to_owned()).chain(numbered).map(|name| folder.join(name));
    // A link that leads nowhere takes its name, too.
    paths.find(|path| path.symlink_metadata().is_err()).unwrap_or_else(|| folder.join(name))
}

/// Names of files in a map's folder that are not the map's.
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
