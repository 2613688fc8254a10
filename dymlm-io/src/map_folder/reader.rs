use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::sync::{Arc, OnceLock};

use serde::de::DeserializeOwned;

use super::manifest::{FileEntry, MANIFEST, Manifest, check_name};
use super::replace::{recover_unless_written, resolve};
use super::state::StateIndex;
use crate::Error;

/// How often a folder is read that is replaced while it is read. More than one replacement within the time of
/// a reading is rare.
const MOST_TRIES: usize = 10;

/// A map folder, opened and verified: every file that its manifest lists is there and is as it was written.
///
/// See [`MapFolderWriter`](crate::MapFolderWriter).
#[derive(Debug, Clone)]
pub struct MapFolder {
    folder: PathBuf,
    manifest: Manifest,
    /// Where the parts of the state are, as soon as somebody has asked.
    pub(super) index: Arc<OnceLock<StateIndex>>,
}

impl MapFolder {
    /// Opens a map folder and compares sizes and checksums of its files. When a crash during a replacement
    /// left the map under its temporary name, it is put back first.
    ///
    /// # Errors
    ///
    /// [`Error::Io`] when a file cannot be read; [`Error::Malformed`] or [`Error::Line`] when the folder has
    /// no valid manifest; [`Error::MapVersion`]; [`Error::Checksum`] for the first file that is not as it was
    /// written.
    pub fn open(folder: impl AsRef<Path>) -> Result<Self, Error> {
        let folder = folder.as_ref();
        Self::read_unreplaced(
            || Self::open_unverified(folder),
            |map| {
                let mut files = map.manifest.files.iter();
                files.try_for_each(|file| verify(&map.folder.join(&file.name), file))?;
                Ok(map.clone())
            },
        )
    }

    /// Opens a map folder without verifying its files.
    ///
    /// # Errors
    ///
    /// As [`open`](Self::open), except for sizes and checksums.
    pub fn open_unverified(folder: impl AsRef<Path>) -> Result<Self, Error> {
        let folder = folder.as_ref();
        let mut tries = 0;
        let manifest = loop {
            tries += 1;
            match Manifest::read(folder) {
                // Between the two renames of a writer, and after a crash there, the map is aside.
                Err(error) if error.is_not_found() && tries < MOST_TRIES && is_put_back(folder)? => {}
                read => break read?,
            }
        };
        Ok(Self { folder: folder.to_path_buf(), manifest, index: Arc::default() })
    }

    /// Opens a map folder and reads from it; once more when somebody has replaced the folder meanwhile, since
    /// files of two maps make up none. After some times the last result counts.
    ///
    /// # Errors
    ///
    /// Those of `open` and `read`.
    pub fn read_unreplaced<T, E>(
        open: impl Fn() -> Result<Self, E>,
        mut read: impl FnMut(&Self) -> Result<T, E>,
    ) -> Result<T, E> {
        let mut tries = 0;
        loop {
            let map = open()?;
            let result = read(&map);
            tries += 1;
            if tries == MOST_TRIES || !map.was_replaced() {
                return result;
            }
        }
    }

    /// Whether the folder holds another map than when it was opened, or none.
    pub fn was_replaced(&self) -> bool {
        Manifest::read(&self.folder).map_or(true, |now| now != self.manifest)
    }

    /// Names of the files, in the order in which they were written.
    pub fn files(&self) -> impl Iterator<Item = &str> {
        self.manifest.files.iter().map(|file| file.name.as_str())
    }

    /// Opens a file of the map.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] when the map has no file of this name; [`Error::Io`].
    pub fn reader(&self, name: &str) -> Result<impl BufRead + use<>, Error> {
        let path = self.path(name)?;
        let file = fs::File::open(&path).map_err(Error::io(&path))?;
        Ok(BufReader::with_capacity(1 << 16, file))
    }

    /// Reads a file of the map.
    ///
    /// # Errors
    ///
    /// As [`Self::reader`].
    pub fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        let path = self.path(name)?;
        fs::read(&path).map_err(Error::io(&path))
    }

    /// The path of a file of the map.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] when the map has no file of this name.
    pub fn path(&self, name: &str) -> Result<PathBuf, Error> {
        let path = check_name(&self.folder, name)?;
        if self.files().any(|file| file == name) {
            Ok(path)
        } else {
            Err(Error::malformed(&path, "the map has no file of this name"))
        }
    }

    /// The config that the map was made with.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] when the manifest's config is not a `C`.
    pub fn config<C: DeserializeOwned>(&self) -> Result<C, Error> {
        self.entry("config", &self.manifest.config)
    }

    /// The counts that the map's writer gave.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] when the manifest's counts are not an `N`.
    pub fn counts<N: DeserializeOwned>(&self) -> Result<N, Error> {
        self.entry("counts", &self.manifest.counts)
    }

    /// Whether bytes are those of a file as it was when the map was opened.
    pub(super) fn is_as_listed(&self, name: &str, bytes: &[u8]) -> bool {
        let listed = self.manifest.files.iter().find(|file| file.name == name);
        listed.and_then(|file| file.crc32).is_none_or(|crc32| crc32fast::hash(bytes) == crc32)
    }

    fn entry<T: DeserializeOwned>(&self, name: &str, value: &serde_json::Value) -> Result<T, Error> {
        T::deserialize(value)
            .map_err(|error| Error::malformed(&self.folder.join(MANIFEST), format!("{name}: {error}")))
    }
}

/// Whether a folder without a map has one after all, as soon as its writer is ready or the old one is put
/// back.
fn is_put_back(folder: &Path) -> Result<bool, Error> {
    let has_parent = folder.parent().is_some_and(|parent| parent.as_os_str().is_empty() || parent.exists());
    Ok(has_parent && recover_unless_written(&resolve(folder)?)?)
}

fn verify(path: &Path, entry: &FileEntry) -> Result<(), Error> {
    let mut file = fs::File::open(path).map_err(Error::io(path))?;
    let actual_bytes = file.metadata().map_err(Error::io(path))?.len();
    // A file of another size has changed: its checksum need not be computed.
    let actual_crc32 = match entry.crc32 {
        Some(_) if actual_bytes == entry.bytes => Some(checksum(&mut file).map_err(Error::io(path))?),
        other => other.map(|_| 0),
    };
    if (actual_bytes, actual_crc32) == (entry.bytes, entry.crc32) {
        Ok(())
    } else {
        let (path, bytes) = (path.to_path_buf(), entry.bytes);
        let [crc32, actual_crc32] = [entry.crc32, actual_crc32].map(Option::unwrap_or_default);
        Err(Error::Checksum { path, bytes, crc32, actual_bytes, actual_crc32 })
    }
}

fn checksum(file: &mut fs::File) -> std::io::Result<u32> {
    let mut checksum = crc32fast::Hasher::new();
    let mut buffer = vec![0; 1 << 16];
    loop {
        match file.read(&mut buffer)? {
            0 => return Ok(checksum.finalize()),
            read => checksum.update(buffer.get(..read).unwrap_or_default()),
        }
    }
}
