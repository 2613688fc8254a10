use std::fs;
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

use serde::Serialize;
use tempfile::TempDir;

use super::lock::FolderLock;
use super::manifest::{FileEntry, MANIFEST, Manifest, check_name};
use super::replace::{check_replaceable, put_in_place, recover, resolve, staging_folder};
use crate::Error;
use crate::write_atomically::sync_folder;

/// Writes a map folder so that a crash never leaves it half-written, and an older map stays until the new one
/// is complete.
///
/// Files go to a temporary folder beside the map's own. [`Self::finish`] adds `manifest.json` (format
/// version, config, counts, and size and CRC-32 of each file), flushes everything to the disk and puts the
/// folder in the map's place. A writer that is dropped before leaves nothing. A writer whose process is
/// killed leaves its temporary folder (`.NAME.dymlm-new-...`), which the next writer removes, but never an
/// incomplete map.
///
/// **One writer at a time** among all processes: it locks `.NAME.dymlm-lock` beside the folder.
///
/// **Replacing.** An older map is renamed to `.NAME.dymlm-old`, the new one is renamed to its place, then the
/// old one is removed, since no portable call exchanges two folders. After a crash between the two renames,
/// the next writer or [`MapFolder::open`](crate::MapFolder::open) puts the old map back. Files that are no
/// part of the older map (someone's notes) are moved to the new folder. A folder that is neither empty nor a
/// map is never replaced.
///
/// ```
/// # let parent = tempfile::tempdir()?;
/// # let folder = parent.path().join("map");
/// use std::collections::BTreeMap;
/// use dymlm_io::{MapFolder, MapFolderWriter};
///
/// let mut writer = MapFolderWriter::create(&folder)?;
/// writer.file("greeting.txt", |out| writeln!(out, "hello"))?;
/// writer.finish(&"the config", &BTreeMap::from([("greetings", 1)]))?;
///
/// let map = MapFolder::open(&folder)?;
/// assert_eq!(map.read("greeting.txt")?, b"hello\n");
/// assert_eq!(map.counts::<BTreeMap<String, usize>>()?["greetings"], 1);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct MapFolderWriter {
    target: PathBuf,
    staging: TempDir,
    files: Vec<FileEntry>,
    /// `None` when a [`MapFolderSaver`](crate::MapFolderSaver) holds the lock.
    _lock: Option<FolderLock>,
}

impl MapFolderWriter {
    /// Begins a map folder at `folder`. A missing parent folder is created.
    ///
    /// # Errors
    ///
    /// [`Error::Locked`] when somebody else writes the folder; [`Error::InTheWay`] when something stands
    /// there that is neither a map folder nor an empty folder; [`Error::Io`].
    pub fn create(folder: impl AsRef<Path>) -> Result<Self, Error> {
        let target = resolve(folder.as_ref())?;
        let lock = FolderLock::take(&target)?;
        Ok(Self { _lock: Some(lock), ..Self::begin(&target)? })
    }

    /// As [`Self::create`], for a caller that has locked the resolved folder.
    pub(super) fn begin(target: &Path) -> Result<Self, Error> {
        Self::check(target)?;
        let staging = staging_folder(target)?;
        Ok(Self { target: target.to_path_buf(), staging, files: Vec::new(), _lock: None })
    }

    /// Puts back a map that a crash left aside, and refuses a folder that holds something other than a map.
    pub(super) fn check(target: &Path) -> Result<(), Error> {
        recover(target)?;
        check_replaceable(target)
    }

    /// The temporary folder that the files are written to until the map is complete.
    pub(super) fn staging(&self) -> &Path {
        self.staging.path()
    }

    /// Adds a file that was written to the [staging](Self::staging) folder and whose parts have checksums of
    /// their own.
    pub(super) fn add(&mut self, name: &str, bytes: u64) {
        self.files.push(FileEntry { name: name.to_owned(), bytes, crc32: None });
    }

    /// Keeps a file of the older map that never changes: it is linked, or copied where linking fails.
    pub(super) fn keep(&mut self, name: &str, bytes: u64) -> Result<(), Error> {
        let (before, now) = (self.target.join(name), self.staging.path().join(name));
        if fs::hard_link(&before, &now).is_err() {
            fs::copy(&before, &now).map_err(Error::io(&before))?;
            fs::File::open(&now).and_then(|file| file.sync_all()).map_err(Error::io(&before))?;
        }
        self.add(name, bytes);
        Ok(())
    }

    /// Writes a file of the map.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] when the name is not a plain file name, is `manifest.json` or is taken;
    /// [`Error::Content`] when `write` fails; [`Error::Io`]. The map does not get the file then.
    pub fn file<E>(
        &mut self,
        name: &str,
        write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
    ) -> Result<(), Error>
    where
        E: Into<Box<dyn std::error::Error + Send + Sync>>,
    {
        // Errors name the final path of the file, not the temporary one.
        let final_path = check_name(&self.target, name)?;
        if self.files.iter().any(|file| file.name.eq_ignore_ascii_case(name)) {
            return Err(Error::malformed(&final_path, "the map has a file of this name already"));
        }
        let path = self.staging.path().join(name);
        match write_checked(&path, &final_path, write) {
            Ok((bytes, crc32)) => {
                self.files.push(FileEntry { name: name.to_owned(), bytes, crc32: Some(crc32) });
                Ok(())
            }
            Err(error) => {
                fs::remove_file(&path).ok();
                Err(error)
            }
        }
    }

    /// Writes the manifest and puts the folder in its place. `config` and `counts` are the caller's own and
    /// say how the map was made and what it contains; they may be anything that JSON can hold.
    ///
    /// # Errors
    ///
    /// [`Error::Content`] when config or counts cannot be JSON; [`Error::InTheWay`] when the folder has got
    /// other content since [`Self::create`]; [`Error::Io`]. An older map is still in its place then.
    pub fn finish<C, N>(self, config: &C, counts: &N) -> Result<(), Error>
    where
        C: Serialize + ?Sized,
        N: Serialize + ?Sized,
    {
        let Self { target, staging, files, _lock } = self;
        let final_path = target.join(MANIFEST);
        let content =
            |source: serde_json::Error| Error::Content { path: final_path.clone(), source: source.into() };
        let config = serde_json::to_value(config).map_err(content)?;
        let counts = serde_json::to_value(counts).map_err(content)?;
        let manifest = Manifest::new(files, config, counts);
        write_checked(&staging.path().join(MANIFEST), &final_path, |out| -> io::Result<()> {
            serde_json::to_writer_pretty(&mut *out, &manifest)?;
            out.write_all(b"\n")
        })?;
        sync_folder(staging.path());
        put_in_place(staging, &target, &manifest)
    }
}

/// Writes a file and flushes it to the disk; returns its size and checksum.
fn write_checked<E>(
    path: &Path,
    final_path: &Path,
    write: impl FnOnce(&mut dyn Write) -> Result<(), E>,
) -> Result<(u64, u32), Error>
where
    E: Into<Box<dyn std::error::Error + Send + Sync>>,
{
    let file = fs::File::create_new(path).map_err(Error::io(final_path))?;
    let checked = CheckedWriter { file, bytes: 0, checksum: crc32fast::Hasher::new() };
    let mut out = BufWriter::with_capacity(1 << 16, checked);
    write(&mut out)
        .map_err(|source| Error::Content { path: final_path.to_path_buf(), source: source.into() })?;
    let checked = out.into_inner().map_err(|error| Error::io(final_path)(error.into_error()))?;
    checked.file.sync_all().map_err(Error::io(final_path))?;
    Ok((checked.bytes, checked.checksum.finalize()))
}

/// Computes the size and checksum of what is written to a file.
struct CheckedWriter {
    file: fs::File,
    bytes: u64,
    checksum: crc32fast::Hasher,
}

impl Write for CheckedWriter {
    fn write(&mut self, buffer: &[u8]) -> io::Result<usize> {
        let written = self.file.write(buffer)?;
        self.checksum.update(buffer.get(..written).unwrap_or(buffer));
        self.bytes += written as u64;
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}
