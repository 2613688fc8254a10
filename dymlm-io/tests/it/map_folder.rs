//! Map folders and atomic files: whole or not at all, whatever happens between.

use std::fs;
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use crate::common::names_in;
use dymlm_io::{Error, MapFolder, MapFolderWriter, write_atomically};
use serde::{Deserialize, Serialize};
use tempfile::TempDir;

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Config {
    voxel_size: f64,
    label: String,
}

#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Counts {
    points: usize,
}

fn config() -> Config {
    Config { voxel_size: 0.1 + 0.2, label: "kitchen".to_owned() }
}

fn place() -> (TempDir, PathBuf) {
    let parent = tempfile::tempdir().unwrap();
    let target = parent.path().join("map");
    (parent, target)
}

/// Writes a map of two files that contain `content`.
fn write_map(target: &Path, content: &str) {
    let mut writer = MapFolderWriter::create(target).unwrap();
    writer.file("cloud.ply", |out| out.write_all(content.as_bytes())).unwrap();
    writer.file("octree.bt", |out| write!(out, "tree of {content}")).unwrap();
    writer.finish(&config(), &Counts { points: content.len() }).unwrap();
}

#[track_caller]
fn assert_map(target: &Path, content: &str) {
    let map = MapFolder::open(target).unwrap();
    assert_eq!(map.files().collect::<Vec<_>>(), ["cloud.ply", "octree.bt"]);
    assert_eq!(map.read("cloud.ply").unwrap(), content.as_bytes());
    let mut tree = String::new();
    map.reader("octree.bt").unwrap().read_to_string(&mut tree).unwrap();
    assert_eq!(tree, format!("tree of {content}"));
    assert_eq!(map.config::<Config>().unwrap(), config());
    assert_eq!(map.counts::<Counts>().unwrap(), Counts { points: content.len() });
    assert_eq!(names_in(target), ["cloud.ply", "manifest.json", "octree.bt"]);
}

#[test]
fn opens_what_it_wrote_and_replaces_it() {
    let (parent, target) = place();
    for content in ["first", "second, longer", ""] {
        write_map(&target, content);
        assert_map(&target, content);
        assert_eq!(names_in(parent.path()), ["map"], "nothing else is left");
    }
    let map = MapFolder::open(&target).unwrap();
    assert!(matches!(map.read("other.txt"), Err(Error::Malformed { .. })));
    assert!(matches!(map.path("../map/cloud.ply"), Err(Error::Malformed { .. })));
    assert!(map.config::<Counts>().unwrap_err().to_string().contains("manifest.json: config"));
}

#[test]
fn makes_missing_parents_and_takes_an_empty_folder() {
    let (_parent, target) = place();
    let deep = target.join("a/b");
    write_map(&deep, "x");
    assert_map(&deep, "x");
    let empty = target.join("empty");
    fs::create_dir(&empty).unwrap();
    write_map(&empty, "y");
    assert_map(&empty, "y");
}

#[cfg(unix)]
#[test]
fn maps_have_the_permissions_of_other_folders_and_links_are_followed() {
    use std::os::unix::fs::PermissionsExt;
    let (parent, target) = place();
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    write_map(&target, "x");
    let plain = parent.path().join("plain");
    fs::create_dir(&plain).unwrap();
    fs::write(plain.join("file"), "").unwrap();
    assert_eq!(mode(&target), mode(&plain));
    assert_eq!(mode(&target.join("cloud.ply")), mode(&plain.join("file")));
    write_atomically(parent.path().join("atomic"), |out| out.write_all(b"x")).unwrap();
    assert_eq!(mode(&parent.path().join("atomic")), mode(&plain.join("file")));

    let link = parent.path().join("link");
    std::os::unix::fs::symlink(&target, &link).unwrap();
    write_map(&link, "through the link");
    assert!(link.is_symlink());
    assert_map(&target, "through the link");
}

#[test]
fn never_replaces_what_is_no_map() {
    let (parent, target) = place();
    fs::create_dir(&target).unwrap();
    fs::write(target.join("thesis.tex"), "years of work").unwrap();
    assert!(matches!(MapFolderWriter::create(&target), Err(Error::InTheWay { .. })));
    // Another program's manifest does not make the folder a map.
    fs::write(target.join("manifest.json"), r#"{"name": "web app", "version": 1}"#).unwrap();
    assert!(matches!(MapFolderWriter::create(&target), Err(Error::InTheWay { .. })));
    assert_eq!(fs::read(target.join("thesis.tex")).unwrap(), b"years of work");

    let file = parent.path().join("file");
    fs::write(&file, "x").unwrap();
    assert!(matches!(MapFolderWriter::create(&file), Err(Error::InTheWay { .. })));
    assert_eq!(fs::read(&file).unwrap(), b"x");

    // Something that gets in the way later is noticed, too.
    let late = parent.path().join("late");
    let writer = MapFolderWriter::create(&late).unwrap();
    fs::create_dir(&late).unwrap();
    fs::write(late.join("notes.txt"), "mine").unwrap();
    assert!(matches!(writer.finish(&(), &()), Err(Error::InTheWay { .. })));
    assert_eq!(names_in(&late), ["notes.txt"]);
    assert_eq!(names_in(parent.path()), ["file", "late", "map"]);
}

#[test]
fn files_that_are_not_the_maps_outlive_it() {
    let (parent, target) = place();
    write_map(&target, "old");
    fs::write(target.join("notes.txt"), "mine").unwrap();
    fs::create_dir(target.join("pictures")).unwrap();
    fs::write(target.join("pictures/1.png"), "png").unwrap();
    write_map(&target, "new");
    assert_eq!(names_in(&target), ["cloud.ply", "manifest.json", "notes.txt", "octree.bt", "pictures"]);
    assert_eq!(fs::read(target.join("notes.txt")).unwrap(), b"mine");
    assert_eq!(fs::read(target.join("pictures/1.png")).unwrap(), b"png");
    assert_eq!(MapFolder::open(&target).unwrap().read("cloud.ply").unwrap(), b"new");
    assert_eq!(names_in(parent.path()), ["map"]);

    // A file under a name that the new map needs is an error, and the old map stays.
    let mut writer = MapFolderWriter::create(&target).unwrap();
    writer.file("notes.txt", |out| out.write_all(b"the map's")).unwrap();
    let error = writer.finish(&(), &()).unwrap_err();
    assert!(matches!(error, Error::InTheWay { path } if path.ends_with("notes.txt")));
    assert_eq!(MapFolder::open(&target).unwrap().read("cloud.ply").unwrap(), b"new");
    assert_eq!(names_in(parent.path()), ["map"]);
}

#[test]
fn a_dropped_writer_leaves_nothing_and_the_old_map() {
    let (parent, target) = place();
    write_map(&target, "old");
    let mut writer = MapFolderWriter::create(&target).unwrap();
    writer.file("cloud.ply", |out| out.write_all(b"half")).unwrap();
    assert_eq!(names_in(parent.path()).len(), 3, "the temporary folder, and the lock");
    drop(writer);
    assert_eq!(names_in(parent.path()), ["map"]);
    assert_map(&target, "old");
}

#[test]
fn a_file_that_fails_is_no_part_of_the_map() {
    let (_parent, target) = place();
    let mut writer = MapFolderWriter::create(&target).unwrap();
    let error = writer
        .file("cloud.ply", |out| {
            out.write_all(b"half")?;
            Err(io::Error::other("no more points"))
        })
        .unwrap_err();
    assert!(matches!(&error, Error::Content { path, .. } if path.ends_with("map/cloud.ply")));
    assert!(error.to_string().contains("no more points"), "{error}");
    // The file's name can be used again.
    writer.file("cloud.ply", |out| out.write_all(b"whole")).unwrap();
    writer.finish(&(), &()).unwrap();
    assert_eq!(MapFolder::open(&target).unwrap().read("cloud.ply").unwrap(), b"whole");
}

#[test]
fn names_that_lead_elsewhere_are_refused() {
    let (parent, target) = place();
    let mut writer = MapFolderWriter::create(&target).unwrap();
    for name in ["", ".", "..", "../x", "a/b", "/etc/passwd", "a\\b", "c:x", "x/", "manifest.json", "nul\0"] {
        let refused = writer.file(name, |out| out.write_all(b"x"));
        assert!(matches!(refused, Err(Error::Malformed { .. })), "{name:?}");
    }
    writer.file("cloud.ply", |_| io::Result::Ok(())).unwrap();
    assert!(writer.file("cloud.ply", |_| io::Result::Ok(())).is_err());
    assert!(writer.file("Cloud.ply", |_| io::Result::Ok(())).is_err(), "one file on some systems");
    writer.finish(&(), &()).unwrap();

    // A manifest that names such files is refused too.
    let manifest = fs::read_to_string(target.join("manifest.json")).unwrap();
    fs::write(parent.path().join("secret"), "").unwrap();
    fs::write(target.join("manifest.json"), manifest.replace("cloud.ply", "../secret")).unwrap();
    assert!(matches!(MapFolder::open(&target), Err(Error::Malformed { .. })));
    // And writers remove nothing outside the folder because of such a manifest.
    let mut writer = MapFolderWriter::create(&target).unwrap();
    writer.file("planes.json", |out| out.write_all(b"{}")).unwrap();
    writer.finish(&(), &()).unwrap();
    assert!(parent.path().join("secret").exists());
    assert_eq!(
        names_in(&target),
        ["cloud.ply", "manifest.json", "planes.json"],
        "no file of the manifest's any more"
    );
}

#[test]
fn a_spoilt_map_is_an_error_naming_the_file() {
    let (_parent, target) = place();
    let fresh = |spoil: &dyn Fn()| {
        write_map(&target, "content");
        spoil();
        MapFolder::open(&target).unwrap_err()
    };
    let cloud = target.join("cloud.ply");
    let flipped = fresh(&|| fs::write(&cloud, "contenT").unwrap());
    assert!(matches!(&flipped, Error::Checksum { bytes: 7, actual_bytes: 7, .. }), "{flipped}");
    assert!(flipped.to_string().contains("cloud.ply"));
    let cut = fresh(&|| fs::write(&cloud, "conten").unwrap());
    assert!(matches!(cut, Error::Checksum { bytes: 7, actual_bytes: 6, .. }));
    let missing = fresh(&|| fs::remove_file(&cloud).unwrap());
    assert!(matches!(&missing, Error::Io { path, .. } if path == &cloud));
    fs::write(&cloud, "content").unwrap();

    let manifest = target.join("manifest.json");
    let whole = fs::read_to_string(&manifest).unwrap();
    let with = |text: &str| {
        fs::write(&manifest, text).unwrap();
        MapFolder::open(&target).unwrap_err()
    };
    // The version's number with a digit before it.
    let newer = with(&whole.replace("\"version\": ", "\"version\": 1"));
    assert!(matches!(newer, Error::MapVersion { found, supported, .. } if found > supported));
    assert!(matches!(with(&whole.replace("dymlm map", "other")), Error::Malformed { .. }));
    assert!(with("{\n\"format\": ").to_string().contains("manifest.json, line 2"));
    for length in 0..whole.trim_end().len() {
        assert!(with(&whole[..length]).to_string().contains("manifest.json"));
    }
    fs::write(&manifest, &whole).unwrap();
    assert_map(&target, "content");
}

/// Every state that a crash between the steps of a replacement can leave, set up by hand.
#[test]
fn recovers_from_a_crash_at_every_step() {
    let aside = |target: &Path| target.with_file_name(".map.dymlm-old");

    // Between the two renames: the old map is aside, and nothing is in its place.
    for by_opening in [true, false] {
        let (parent, target) = place();
        write_map(&target, "old");
        fs::rename(&target, aside(&target)).unwrap();
        if !by_opening {
            drop(MapFolderWriter::create(&target).unwrap());
        }
        assert_map(&target, "old");
        assert_eq!(names_in(parent.path()), ["map"]);
    }
    // The same, but somebody created the folder again since.
    let (parent, target) = place();
    write_map(&target, "old");
    fs::rename(&target, aside(&target)).unwrap();
    fs::create_dir(&target).unwrap();
    drop(MapFolderWriter::create(&target).unwrap());
    assert_map(&target, "old");
    // The same, but somebody put a file there.
    fs::rename(&target, aside(&target)).unwrap();
    fs::create_dir(&target).unwrap();
    fs::write(target.join("notes.txt"), "mine").unwrap();
    assert!(matches!(MapFolderWriter::create(&target), Err(Error::InTheWay { .. })));
    assert_eq!(names_in(parent.path()), [".map.dymlm-old", "map"], "both are kept");

    // After the renames: the new map is in place, and the old one is partly removed.
    for removed in
        [&[][..], &["cloud.ply"], &["cloud.ply", "octree.bt"], &["cloud.ply", "octree.bt", "manifest.json"]]
    {
        let (parent, target) = place();
        write_map(&target, "old");
        fs::write(target.join("notes.txt"), "mine").unwrap();
        fs::rename(&target, aside(&target)).unwrap();
        write_map(&parent.path().join("other"), "new");
        fs::rename(parent.path().join("other"), &target).unwrap();
        if !removed.is_empty() {
            fs::rename(aside(&target).join("notes.txt"), target.join("notes.txt")).unwrap();
        }
        for name in removed {
            fs::remove_file(aside(&target).join(name)).unwrap();
        }
        assert_eq!(MapFolder::open(&target).unwrap().read("cloud.ply").unwrap(), b"new");
        write_map(&target, "newer");
        assert_eq!(fs::read(target.join("notes.txt")).unwrap(), b"mine", "{removed:?}");
        assert_eq!(names_in(parent.path()), ["map"], "{removed:?}");
    }
}

#[test]
fn a_file_beside_the_old_map_gives_way_to_one_of_the_same_name() {
    let (parent, target) = place();
    write_map(&target, "old");
    fs::write(target.join("notes.txt"), "mine").unwrap();
    fs::rename(&target, target.with_file_name(".map.dymlm-old")).unwrap();
    write_map(&parent.path().join("other"), "new");
    fs::rename(parent.path().join("other"), &target).unwrap();
    // As a file manager does by itself.
    fs::write(target.join("notes.txt"), "newer").unwrap();

    for content in ["next", "last"] {
        write_map(&target, content);
        assert_eq!(fs::read(target.join("notes.txt")).unwrap(), b"newer");
        assert_eq!(fs::read(target.join("notes.txt.1")).unwrap(), b"mine");
        assert_eq!(names_in(parent.path()), ["map"]);
    }
}

#[test]
fn a_map_of_another_version_can_be_replaced() {
    let (parent, target) = place();
    write_map(&target, "old");
    let manifest = fs::read_to_string(target.join("manifest.json")).unwrap();
    fs::write(target.join("manifest.json"), manifest.replace("\"version\": 3", "\"version\": 9")).unwrap();
    let mut writer = MapFolderWriter::create(&target).unwrap();
    writer.file("planes.json", |out| out.write_all(b"{}")).unwrap();
    writer.finish(&(), &()).unwrap();
    assert_eq!(names_in(&target), ["manifest.json", "planes.json"]);
    assert_eq!(names_in(parent.path()), ["map"]);
}

#[test]
fn config_that_json_cannot_hold_is_an_error() {
    let (parent, target) = place();
    let writer = MapFolderWriter::create(&target).unwrap();
    let keys_that_are_no_strings = std::collections::BTreeMap::from([(vec![1], 2)]);
    assert!(matches!(writer.finish(&keys_that_are_no_strings, &()), Err(Error::Content { .. })));
    assert!(names_in(parent.path()).is_empty());
}

/// Regression: the link was replaced by the file, and what it led to stayed as it was.
#[cfg(unix)]
#[test]
fn a_link_is_followed() {
    let folder = tempfile::tempdir().unwrap();
    let [file, link] = ["numbers.txt", "latest.txt"].map(|name| folder.path().join(name));
    fs::write(&file, "old").unwrap();
    std::os::unix::fs::symlink("numbers.txt", &link).unwrap();
    write_atomically(&link, |out| out.write_all(b"new")).unwrap();
    assert!(link.is_symlink());
    assert_eq!(fs::read_to_string(&file).unwrap(), "new");
    assert_eq!(names_in(folder.path()), ["latest.txt", "numbers.txt"]);
}

/// A pipe or a device is written to, and never replaced by a file.
#[cfg(unix)]
#[test]
fn what_is_no_file_is_written_to() {
    use std::os::unix::fs::FileTypeExt;
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("nowhere");
    std::os::unix::fs::symlink("/dev/null", &link).unwrap();
    write_atomically(&link, |out| out.write_all(b"x")).unwrap();
    assert!(link.is_symlink() && fs::metadata(&link).unwrap().file_type().is_char_device());

    let pipe = folder.path().join("pipe");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let reader = std::thread::spawn({
        let pipe = pipe.clone();
        move || fs::read(pipe).unwrap()
    });
    write_atomically(&pipe, |out| out.write_all(b"through the pipe")).unwrap();
    assert_eq!(reader.join().unwrap(), b"through the pipe");
    assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
    let failed = write_atomically(&link, |_| Err::<(), _>("nothing to write"));
    assert!(failed.unwrap_err().to_string().contains("nothing to write"));
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "nothing was left behind");
}

#[test]
fn an_atomic_file_is_whole_or_as_it_was() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("file.txt");
    write_atomically(&path, |out| out.write_all(b"first")).unwrap();
    let failed = write_atomically(&path, |out| {
        out.write_all(&vec![0; 1 << 20])?;
        Err(io::Error::other("disk of straw"))
    });
    assert!(failed.unwrap_err().to_string().contains("disk of straw"));
    assert_eq!(fs::read(&path).unwrap(), b"first");
    write_atomically(&path, |out| out.write_all(b"second")).unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"second");
    assert_eq!(names_in(folder.path()), ["file.txt"]);
    let nowhere = write_atomically(folder.path().join("no/file"), |out| out.write_all(b"x"));
    assert!(matches!(nowhere, Err(Error::Io { .. })));
    let onto_a_folder = write_atomically(folder.path(), |out| out.write_all(b"x"));
    assert!(matches!(onto_a_folder, Err(Error::Io { .. })));
}

/// Regression: the link was replaced, and the file was not where it leads to.
#[cfg(unix)]
#[test]
fn a_link_to_a_file_that_is_not_there_yet_is_followed() {
    let parent = tempfile::tempdir().unwrap();
    let [first, second, file] = ["first", "second", "file"].map(|name| parent.path().join(name));
    std::os::unix::fs::symlink("second", &first).unwrap();
    std::os::unix::fs::symlink(&file, &second).unwrap();
    write_atomically(&first, |out| writeln!(out, "content")).unwrap();
    assert!(first.is_symlink() && second.is_symlink());
    assert_eq!(fs::read_to_string(&file).unwrap(), "content\n");
    // Links that lead nowhere but to each other are no place for a file.
    let [a, b] = ["a", "b"].map(|name| parent.path().join(name));
    std::os::unix::fs::symlink(&a, &b).unwrap();
    std::os::unix::fs::symlink(&b, &a).unwrap();
    write_atomically(&a, |out| writeln!(out, "content")).ok();
}

/// Regression: the finished map could not take the place of what a disk is mounted on, and was thrown away.
#[cfg(target_os = "linux")]
#[test]
fn a_mount_point_is_refused_before_anything_is_mapped() {
    let refused = MapFolderWriter::create("/proc").unwrap_err();
    assert!(refused.to_string().contains("mount point"), "{refused}");
}

/// Regression: after a crash between two renames somebody has made the folder anew, as a start script does.
#[test]
fn a_map_that_a_crash_left_aside_is_read_though_an_empty_folder_is_in_its_place() {
    let (_parent, target) = place();
    write_map(&target, "old");
    fs::rename(&target, target.with_file_name(".map.dymlm-old")).unwrap();
    fs::create_dir(&target).unwrap();
    assert_map(&target, "old");
}
