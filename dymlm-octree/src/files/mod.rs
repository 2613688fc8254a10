//! OctoMap's file formats.

mod bt;
mod header;
mod ot;

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{BufReader, BufWriter, ErrorKind};
use std::path::{Path, PathBuf};

use header::Header;

use crate::storage::Tree;
use crate::{Error, Octree, OctreeConfig};

/// A file that ends too early is damaged; everything else is a failure to read.
fn read_error(error: std::io::Error) -> Error {
    if error.kind() == ErrorKind::UnexpectedEof {
        Error::Malformed("it ends in the middle of the tree".to_owned())
    } else {
        error.into()
    }
}

/// Names the file in an error.
pub(crate) fn at(path: &Path) -> impl Fn(Error) -> Error {
    move |error| match error {
        Error::Io { source, .. } => Error::Io { path: format!("{}: ", path.display()), source },
        Error::Malformed(what) => Error::Malformed(format!("{}: {what}", path.display())),
        other => Error::File { path: path.display().to_string(), source: Box::new(other) },
    }
}

/// Reads the map of a file: cell size and colour mode come from the file, all else from `config`. `read`
/// fills the tree and counts its nodes.
fn read_tree(
    header: &Header,
    mut config: OctreeConfig,
    color: bool,
    read: impl FnOnce(&mut Tree) -> Result<u64, Error>,
) -> Result<Octree, Error> {
    (config.resolution, config.color) = (header.resolution, color);
    config.validate()?;
    let mut tree = Tree::new(color);
    let (promised, nodes) = (header.size, if header.size > 0 { read(&mut tree)? } else { 0 });
    if nodes != promised {
        return Err(Error::Malformed(format!("{nodes} nodes, but its header says {promised}")));
    }
    tree.settle_all();
    Ok(Octree::from_parts(config, tree))
}

/// Reads a file. Errors name it.
fn load(path: &Path, read: impl FnOnce(BufReader<File>) -> Result<Octree, Error>) -> Result<Octree, Error> {
    let file = File::open(path).map_err(|source| at(path)(source.into()))?;
    read(BufReader::new(file)).map_err(at(path))
}

/// Links that are followed, one leading to the next, at most.
const MOST_LINKS: usize = 40;

/// Writes a file completely or not at all: under another name beside it, then renamed. When that fails, an
/// older file stays as it was. A symbolic link is followed. Errors name the file.
pub(crate) fn save(
    path: &Path,
    write: impl FnOnce(&mut BufWriter<File>) -> Result<(), Error>,
) -> Result<(), Error> {
    // A pipe or a device is written to, never replaced.
    if fs::metadata(path).is_ok_and(|found| !found.is_file()) {
        return File::create(path)
            .map_err(Error::from)
            .and_then(|file| write(&mut BufWriter::new(file)))
            .map_err(at(path));
    }
    // Renaming replaces a link itself, and whoever reads what it leads to would never see the new file.
    let target = followed(path);
    let (temporary, file) = create_beside(&target).map_err(Error::from).map_err(at(path))?;
    let mut writer = BufWriter::new(file);
    let written = write(&mut writer).and_then(|()| {
        let file = writer.into_inner().map_err(std::io::IntoInnerError::into_error)?;
        file.sync_all()?;
        drop(file);
        Ok(fs::rename(&temporary, &target)?)
    });
    if written.is_err() {
        // Nothing better can be done about a file that cannot be removed.
        fs::remove_file(&temporary).ok();
    }
    written.map_err(at(path))
}

/// Where a path leads, also through links to a file that is not there yet.
fn followed(path: &Path) -> PathBuf {
    let mut target = path.to_path_buf();
    for _ in 0..MOST_LINKS {
        let Ok(next) = fs::read_link(&target) else { break };
        // A relative link begins in its own folder.
        target = target.parent().unwrap_or(Path::new("")).join(next);
    }
    fs::canonicalize(&target).unwrap_or(target)
}

/// A new file in the folder of `path`.
fn create_beside(path: &Path) -> std::io::Result<(PathBuf, File)> {
    let Some(name) = path.file_name() else { return Err(ErrorKind::InvalidInput.into()) };
    let mut attempt = 0_u32;
    loop {
        let mut temporary = OsString::from(".");
        temporary.push(name);
        temporary.push(format!(".{}-{attempt}", std::process::id()));
        let temporary = path.with_file_name(temporary);
        match File::create_new(&temporary) {
            Err(error) if error.kind() == ErrorKind::AlreadyExists && attempt < 1000 => attempt += 1,
            created => return created.map(|file| (temporary, file)),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::*;

    #[test]
    fn a_failed_save_leaves_the_older_file() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.ot");
        let map = Octree::new(OctreeConfig::default()).unwrap();
        map.save_ot(&path).unwrap();
        let before = fs::read(&path).unwrap();
        let error = save(&path, |writer| {
            writer.write_all(&vec![7; 100_000])?;
            Err(Error::Malformed("the disk is full".to_owned()))
        })
        .unwrap_err();
        assert!(error.to_string().contains("map.ot"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), before);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "something was left behind");
        map.save_bt(&path).unwrap();
        assert_ne!(fs::read(&path).unwrap(), before);
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn every_error_of_a_file_names_it() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.ot");
        for header in ["id Other\nsize 0\nres 0.1", "id OcTree\nsize 0\nres -1", "id OcTree\nsize 9\nres 1"] {
            fs::write(&path, format!("# Octomap OcTree file\n{header}\ndata\n")).unwrap();
            let error = Octree::load_ot(&path, OctreeConfig::default()).unwrap_err();
            assert_eq!(error.to_string().matches("map.ot: ").count(), 1, "{error}");
        }
    }
}
