use std::fs;
use std::path::{Component, Path, PathBuf};

use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};

use crate::Error;

pub(super) const MANIFEST: &str = "manifest.json";

/// Identifies the manifest of a map.
const FORMAT: &str = "dymlm map";

/// The format version that is written, and the only one that is read.
const VERSION: u32 = 14;

/// `manifest.json`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct Manifest {
    format: String,
    version: u32,
    pub(super) files: Vec<FileEntry>,
    /// The caller's own: how the map was made.
    pub(super) config: serde_json::Value,
    /// The caller's own: what the map contains.
    pub(super) counts: serde_json::Value,
}

/// A file of the folder.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(super) struct FileEntry {
    pub(super) name: String,
    pub(super) bytes: u64,
    /// `None` for a file whose parts have their own checksums.
    pub(super) crc32: Option<u32>,
}

/// The beginning of every version's manifest.
#[derive(Deserialize)]
struct Preamble {
    format: String,
    version: u32,
}

/// The part of every version's manifest that lists the map's files.
#[derive(Deserialize)]
struct FileList {
    files: Vec<FileName>,
}

#[derive(Deserialize)]
struct FileName {
    name: String,
}

impl Manifest {
    pub(super) fn new(files: Vec<FileEntry>, config: serde_json::Value, counts: serde_json::Value) -> Self {
        Self { format: FORMAT.to_owned(), version: VERSION, files, config, counts }
    }

    /// Reads the manifest of a folder.
    pub(super) fn read(folder: &Path) -> Result<Self, Error> {
        let path = folder.join(MANIFEST);
        let bytes = fs::read(&path).map_err(Error::io(&path))?;
        let broken = |error: serde_json::Error| Error::line(&path, error.line().max(1), error.to_string());
        let preamble: Preamble = serde_json::from_slice(&bytes).map_err(broken)?;
        if preamble.format != FORMAT {
            return Err(Error::malformed(&path, "not the manifest of a map"));
        }
        if preamble.version != VERSION {
            return Err(Error::MapVersion { path, found: preamble.version, supported: VERSION });
        }
        let manifest: Self = serde_json::from_slice(&bytes).map_err(broken)?;
        for file in &manifest.files {
            check_name(folder, &file.name)?;
        }
        Ok(manifest)
    }

    /// Whether a folder holds a map, of this or any other version.
    pub(super) fn marks(folder: &Path) -> bool {
        parse::<Preamble>(folder).is_some_and(|preamble| preamble.format == FORMAT)
    }

    /// Names of the files of the map in a folder, of this or any other version; none when it holds no map.
    pub(super) fn file_names(folder: &Path) -> Vec<String> {
        let list = parse::<FileList>(folder).map(|list| list.files).unwrap_or_default();
        list.into_iter().map(|file| file.name).filter(|name| check_name(folder, name).is_ok()).collect()
    }
}

/// Some fields of a folder's manifest; `None` without a valid manifest.
fn parse<T: DeserializeOwned>(folder: &Path) -> Option<T> {
    let bytes = fs::read(folder.join(MANIFEST)).ok()?;
    serde_json::from_slice(&bytes).ok()
}

/// The path of a file in a folder. A name with a folder in it is refused, since it could lead out of the
/// folder.
pub(super) fn check_name(folder: &Path, name: &str) -> Result<PathBuf, Error> {
    let mut components = Path::new(name).components();
    let plain = matches!((components.next(), components.next()), (Some(Component::Normal(part)), None) if part == name);
    if plain && name != MANIFEST && !name.contains(['/', '\\', '\0', ':']) {
        Ok(folder.join(name))
    } else {
        Err(Error::malformed(folder, format!("{name:?} is not allowed as the name of a file of a map")))
    }
}
