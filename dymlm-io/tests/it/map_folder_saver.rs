//! Saving into one folder again and again: what is written, what stays, and what a crash leaves.

use std::collections::BTreeMap;
use std::fs;
use std::io::{BufRead, BufReader, Read, Write};
use std::path::Path;

use dymlm_io::{Error, MapFolder, MapFolderSaver, MapFolderWriter};
use proptest::prelude::*;

type Parts = BTreeMap<u64, Vec<u8>>;

fn read(folder: &Path, section: &str) -> Parts {
    MapFolder::open(folder).unwrap().state(section).unwrap().collect::<Result<_, _>>().unwrap()
}

fn save(saver: &mut MapFolderSaver, section: &str, changes: &[(u64, Option<Vec<u8>>)]) -> Result<(), Error> {
    saver.save("config", &0, |folder, state| {
        folder.file("readme.txt", |out| writeln!(out, "{} changes", changes.len()))?;
        state
            .section(section, |part| changes.iter().try_for_each(|(key, bytes)| part(*key, bytes.as_deref())))
    })
}

/// Size of the segment that was written last.
fn newest_segment(folder: &Path) -> u64 {
    let names = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let newest = names.filter(|name| name.starts_with("state-")).max().unwrap();
    fs::metadata(folder.join(newest)).unwrap().len()
}

/// Bytes that deflate cannot compress.
fn noise(seed: u64, len: usize) -> Vec<u8> {
    let mut random = dymlm_core::SplitMix64::new(seed);
    (0..len).map(|_| random.below(256) as u8).collect()
}

#[test]
fn what_is_not_as_it_was_left_is_not_gone_on_with() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut saver = MapFolderSaver::create(&folder).unwrap();
    save(&mut saver, "a", &[(1, Some(noise(1, 5000))), (2, Some(b"two".to_vec()))]).unwrap();
    assert!(saver.is_as_left());
    fs::remove_dir_all(&folder).unwrap();
    assert!(!saver.is_as_left());
    let refused = save(&mut saver, "a", &[(2, Some(b"zwei".to_vec()))]);
    assert!(matches!(refused, Err(Error::Malformed { .. })), "{refused:?}");
    assert!(!folder.exists());
    saver.forget();
    save(&mut saver, "a", &[(2, Some(b"zwei".to_vec()))]).unwrap();
    assert_eq!(read(&folder, "a"), Parts::from([(2, b"zwei".to_vec())]));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]

    #[test]
    fn saves_one_after_the_other_make_what_they_say(
        saves in prop::collection::vec(
            prop::collection::vec((0_u64..2, 0_u64..30, prop::option::of((any::<u64>(), 0_usize..3000))), 0..20), 1..25)
    ) {
        let parent = tempfile::tempdir().unwrap();
        let folder = parent.path().join("map");
        let mut saver = MapFolderSaver::create(&folder).unwrap();
        let mut expected = [Parts::new(), Parts::new()];
        for changes in saves {
            saver.save("config", &0, |_, state| {
                for &(section, key, content) in &changes {
                    let bytes = content.map(|(seed, len)| match seed % 2 {
                        0 => vec![seed as u8; len],
                        _ => noise(seed, len),
                    });
                    state.section(["a", "b"][section as usize], |part| part(key, bytes.as_deref()))?;
                    match bytes {
                        Some(bytes) => drop(expected[section as usize].insert(key, bytes)),
                        None => drop(expected[section as usize].remove(&key)),
                    }
                }
                Ok(())
            }).unwrap();
            prop_assert_eq!(read(&folder, "a"), expected[0].clone());
            prop_assert_eq!(read(&folder, "b"), expected[1].clone());
        }
    }
}

#[test]
fn what_has_not_changed_is_not_written_again() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut saver = MapFolderSaver::create(&folder).unwrap();
    let all: Vec<_> = (0..100).map(|key| (key, Some(noise(key, 10_000)))).collect();
    save(&mut saver, "a", &all).unwrap();
    assert!(newest_segment(&folder) >= 1_000_000);
    let mut written = 0;
    for step in 0..50 {
        save(&mut saver, "a", &[(step, Some(noise(1000 + step, 10_000)))]).unwrap();
        written += newest_segment(&folder);
        assert!(fs::read_dir(&folder).unwrap().count() <= 12);
    }
    // Each change is written once, and some parts are copied to keep segments few; saving all each time would
    // be 50 MB.
    assert!(written < 5_000_000, "{written}");
    let expected: Parts =
        (0..100).map(|key| (key, noise(if key < 50 { 1000 + key } else { key }, 10_000))).collect();
    assert!(read(&folder, "a") == expected);
    let bytes: u64 =
        fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
    assert!(bytes < 2_100_000, "{bytes}");

    saver.forget();
    save(&mut saver, "a", &all[..1]).unwrap();
    assert!(
        read(&folder, "a") == all[..1].iter().map(|(key, bytes)| (*key, bytes.clone().unwrap())).collect()
    );
}

#[test]
fn a_save_that_fails_leaves_the_one_before() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut saver = MapFolderSaver::create(&folder).unwrap();
    save(&mut saver, "a", &[(1, Some(b"one".to_vec()))]).unwrap();
    let failed = saver.save("config", &0, |folder, state| {
        state.section("a", |part| part(1, Some(b"another")))?;
        folder.file("cloud.ply", |_| Err::<(), _>("the disk is full"))
    });
    assert!(matches!(failed, Err(Error::Content { .. })));
    assert_eq!(read(&folder, "a"), [(1, b"one".to_vec())].into());
    save(&mut saver, "a", &[(2, Some(b"two".to_vec()))]).unwrap();
    assert_eq!(read(&folder, "a"), [(1, b"one".to_vec()), (2, b"two".to_vec())].into());
    assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 2, "the map, and its lock");
}

/// A path with a mistake in it leaves no folders behind.
#[test]
fn a_map_that_is_not_there_is_not_opened() {
    let parent = tempfile::tempdir().unwrap();
    for path in ["typo/of/a/path/map", "map"] {
        let refused = MapFolderSaver::open(parent.path().join(path)).unwrap_err();
        assert!(matches!(refused, Error::Io { .. }), "{refused}");
        assert!(refused.to_string().contains(path), "{refused}");
        assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 0, "{path}");
    }
    // One that a crash has left aside is.
    let folder = parent.path().join("map");
    save(&mut MapFolderSaver::create(&folder).unwrap(), "a", &[(1, Some(b"one".to_vec()))]).unwrap();
    fs::rename(&folder, parent.path().join(".map.dymlm-old")).unwrap();
    let (saver, _) = MapFolderSaver::open(&folder).unwrap();
    assert_eq!(read(saver.folder(), "a"), [(1, b"one".to_vec())].into());
}

#[test]
fn one_writes_at_a_time() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let saver = MapFolderSaver::create(&folder).unwrap();
    assert!(matches!(MapFolderSaver::create(&folder), Err(Error::Locked { .. })));
    let refused = MapFolderWriter::create(&folder).unwrap_err();
    assert!(matches!(refused, Error::Locked { .. }));
    assert!(refused.to_string().contains("somebody else writes this map"), "{refused}");
    drop(saver);
    let writer = MapFolderWriter::create(&folder).unwrap();
    assert!(matches!(MapFolderSaver::create(&folder), Err(Error::Locked { .. })));
    drop(writer);
    MapFolderSaver::create(&folder).unwrap();
}

#[test]
fn what_killed_writers_left_is_cleared() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let stale = parent.path().join(".map.dymlm-new-abc123");
    fs::create_dir(&stale).unwrap();
    fs::write(stale.join("state-000001.bin"), "half").unwrap();
    let other = parent.path().join(".map2.dymlm-new-abc123");
    fs::create_dir(&other).unwrap();
    save(&mut MapFolderSaver::create(&folder).unwrap(), "a", &[]).unwrap();
    assert!(!stale.exists() && other.exists());
}

#[test]
fn a_damaged_part_is_named_and_the_others_are_read() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let parts: Vec<_> = (0..5).map(|key| (key, Some(noise(key, 100)))).collect();
    save(&mut MapFolderSaver::create(&folder).unwrap(), "a", &parts).unwrap();
    let path = folder.join("state-000001.bin");
    let mut bytes = fs::read(&path).unwrap();
    bytes[250] ^= 1;
    fs::write(&path, bytes).unwrap();
    let map = MapFolder::open(&folder).unwrap();
    let read: Vec<_> = map.state("a").unwrap().collect();
    assert!(read.iter().enumerate().all(|(key, part)| part.is_ok() == (key != 2)));
    let damaged = read[2].as_ref().unwrap_err();
    assert_eq!((damaged.section.as_str(), damaged.part), ("a", 2));
    assert!(damaged.to_string().contains("state-000001.bin: another checksum"), "{damaged}");
    assert_eq!(map.state("b").unwrap().count(), 0);

    fs::write(&path, b"cut").unwrap();
    assert!(matches!(MapFolder::open(&folder), Err(Error::Checksum { .. })));
}

#[test]
fn a_folder_without_a_state_says_so() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    MapFolderWriter::create(&folder).unwrap().finish("config", &0).unwrap();
    let map = MapFolder::open(&folder).unwrap();
    assert!(!map.has_state());
    assert!(matches!(map.state("a"), Err(Error::Malformed { .. })));
}

/// Save number `number` of the process that is killed: each part and each file contains the number.
fn save_number(saver: &mut MapFolderSaver, number: u64) {
    let saved = saver.save("config", &number, |folder, state| {
        folder.file("cloud.ply", |out| writeln!(out, "{number}"))?;
        // A third of the parts changes in each save; save 0 writes all.
        state.section("a", |part| {
            for key in (0..30).filter(|key| number == 0 || key % 3 == number % 3) {
                part(key, Some(&[number.to_le_bytes().to_vec(), noise(number ^ key, 5000)].concat()))?;
            }
            Ok(())
        })
    });
    saved.unwrap();
}

/// The number of the save that a folder holds; panics when the save is incomplete.
fn number_of(folder: &Path) -> u64 {
    let map = MapFolder::open(folder).unwrap();
    let number: u64 = map.counts().unwrap();
    assert_eq!(map.read("cloud.ply").unwrap(), format!("{number}\n").as_bytes());
    let parts = read(folder, "a");
    assert_eq!(parts.len(), 30);
    for (key, bytes) in parts {
        // The last save that changed the part, or save 0, which wrote all.
        let expected = number.saturating_sub((number + 3 - key % 3) % 3);
        let at = |number: u64| bytes == [number.to_le_bytes().to_vec(), noise(number ^ key, 5000)].concat();
        assert!(at(expected), "part {key} of save {number}");
    }
    number
}

/// The process that is killed: it saves without end.
#[test]
#[ignore = "another test runs it and kills it"]
fn saves_until_it_is_killed() {
    let Some(folder) = std::env::var_os("DYMLM_SAVE_TO") else { return };
    let mut saver = MapFolderSaver::create(Path::new(&folder)).unwrap();
    for number in 0.. {
        save_number(&mut saver, number);
        // Written to stdout directly, since the test harness captures `println!`.
        writeln!(std::io::stdout(), "saved {number}").unwrap();
    }
}

/// The environment variable `DYMLM_KILLS` sets the number of kills (`.ci/nightly`: 1,000).
#[test]
fn a_writer_that_is_killed_leaves_the_map_before_or_the_map_after() {
    let kills = std::env::var("DYMLM_KILLS").map_or(25, |kills| kills.parse().unwrap());
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut random = dymlm_core::SplitMix64::new(7);
    let mut most = 0;
    for _ in 0..kills {
        let mut child = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--ignored", "--exact", "map_folder_saver::saves_until_it_is_killed"])
            .env("DYMLM_SAVE_TO", &folder)
            .stdout(std::process::Stdio::piped())
            .spawn()
            .unwrap();
        // It is killed during or after one of its first saves, however slow the machine is.
        let saves = random.below(8);
        let mut output = BufReader::new(child.stdout.take().unwrap());
        let mut printed = String::new();
        while printed.matches("saved ").count() < saves {
            assert!(output.read_line(&mut printed).unwrap() > 0, "it ends only when it is killed: {printed}");
        }
        std::thread::sleep(std::time::Duration::from_micros(random.below(20_000) as u64));
        child.kill().unwrap();
        output.read_to_string(&mut printed).unwrap();
        child.wait().unwrap();
        // The last line may be cut off.
        let whole = printed.rsplit_once('\n').map_or("", |(whole, _)| whole);
        let last = whole.lines().rev().find_map(|line| line.rsplit_once("saved ")?.1.parse::<u64>().ok());
        if let Some(last) = last {
            let number = number_of(&folder);
            assert!(number == last || number == last + 1, "save {number}, after {last}");
            most = most.max(number);
        } else if most > 0 {
            number_of(&folder);
        }
    }
    assert!(most > 5, "{most} saves");
    // The next writer removes what killed writers left.
    save_number(&mut MapFolderSaver::create(&folder).unwrap(), 0);
    assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 1);
}

/// Runs under a limit to the size of files, which acts like a full disk: the second save does not fit.
#[test]
#[ignore = "another test runs it where files cannot grow"]
fn saves_more_than_fits() {
    let Some(folder) = std::env::var_os("DYMLM_SAVE_TO") else { return };
    let mut saver = MapFolderSaver::create(Path::new(&folder)).unwrap();
    save_number(&mut saver, 0);
    let full = save(&mut saver, "a", &[(1, Some(noise(1, 2_000_000)))]).unwrap_err();
    assert!(matches!(full, Error::Io { .. }), "{full}");
    // The first save is still there, and a save that fits succeeds.
    assert_eq!(number_of(Path::new(&folder)), 0);
    save_number(&mut saver, 1);
}

#[cfg(unix)]
#[test]
fn a_full_disk_leaves_the_map_before_and_the_next_save_succeeds() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    // 512 kB per file. XFSZ is ignored, since that signal would end the process.
    let run = std::process::Command::new("sh")
        .args(["-c", "trap '' XFSZ; ulimit -f 1024; exec \"$0\" --ignored --exact map_folder_saver::saves_more_than_fits"])
        .arg(std::env::current_exe().unwrap())
        .env("DYMLM_SAVE_TO", &folder)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&run.stdout);
    assert!(run.status.success() && said.contains("1 passed"), "{said}");
    assert_eq!(number_of(&folder), 1);
    assert_eq!(fs::read_dir(parent.path()).unwrap().count(), 1, "nothing else is left");
}

#[test]
fn a_folder_that_cannot_be_made_is_named() {
    let parent = tempfile::tempdir().unwrap();
    let file = parent.path().join("file");
    fs::write(&file, "no folder").unwrap();
    let refused = MapFolderSaver::create(file.join("map")).unwrap_err();
    assert!(matches!(refused, Error::Io { .. }) && refused.to_string().contains("file"), "{refused}");
    assert!(matches!(MapFolderSaver::create(&file), Err(Error::InTheWay { .. })));
}

/// Runs where the map's folder and its parent are mounted read-only.
#[test]
#[ignore = "another test runs it where nothing can be written"]
fn reads_where_nothing_can_be_written() {
    let Some(folder) = std::env::var_os("DYMLM_SAVE_TO") else { return };
    let folder = Path::new(&folder);
    let refused = MapFolderSaver::create(folder).unwrap_err();
    assert!(matches!(refused, Error::Io { .. }), "{refused}");
    assert!(refused.to_string().contains("map"), "{refused}");
    assert!(matches!(MapFolderWriter::create(folder), Err(Error::Io { .. })));
    assert_eq!(number_of(folder), 0);
}

/// Mounts the folder read-only, since permissions do not stop root. Skipped where mounting is not allowed.
#[cfg(target_os = "linux")]
#[test]
fn a_folder_that_is_read_only_is_read_and_refuses_to_be_written() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    save_number(&mut MapFolderSaver::create(&folder).unwrap(), 0);
    let mounted = |then: &str| {
        let mount = "mount --bind \"$1\" \"$1\" && mount -o remount,bind,ro \"$1\"";
        std::process::Command::new("unshare")
            .args(["--map-root-user", "--mount", "sh", "-c", &format!("{mount} && {then}")])
            .arg(std::env::current_exe().unwrap())
            .arg(parent.path())
            .env("DYMLM_SAVE_TO", &folder)
            .output()
    };
    if !mounted("true").is_ok_and(|run| run.status.success()) {
        return;
    }
    let run = mounted("exec \"$0\" --ignored --exact map_folder_saver::reads_where_nothing_can_be_written")
        .unwrap();
    let said = String::from_utf8_lossy(&run.stdout);
    assert!(run.status.success() && said.contains("1 passed"), "{said}");
    assert_eq!(number_of(&folder), 0);
}

/// Regression: a save that copied parts out of the damaged segment failed, and so did all later ones.
#[test]
fn a_damaged_segment_keeps_nothing_new_from_being_saved() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut saver = MapFolderSaver::create(&folder).unwrap();
    save(&mut saver, "a", &[(1, Some(noise(1, 10_000)))]).unwrap();
    let segment = folder.join("state-000001.bin");
    let mut bytes = fs::read(&segment).unwrap();
    bytes[500] ^= 1;
    fs::write(&segment, bytes).unwrap();

    let mut was_noticed = false;
    for key in 2..20 {
        if !saver.is_as_left() {
            // All that is in memory is saved again.
            was_noticed = true;
            saver.forget();
            let all: Vec<_> = (1..key).map(|key| (key, Some(noise(key, 10_000)))).collect();
            save(&mut saver, "a", &all).unwrap();
        }
        save(&mut saver, "a", &[(key, Some(noise(key, 10_000)))]).unwrap();
        let parts = MapFolder::open(&folder).unwrap().state("a").unwrap();
        let damaged = parts.filter(Result::is_err).count();
        assert_eq!(damaged, usize::from(!was_noticed), "after part {key}");
    }
    assert!(was_noticed);
}

/// Regression: each section was looked up anew, so that those of two saves were taken for one map.
#[test]
fn all_sections_are_those_of_the_save_that_was_opened() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut saver = MapFolderSaver::create(&folder).unwrap();
    let mut save_both = |number: u8| {
        let both = saver.save("config", &0, |_, state| {
            ["a", "b"].iter().try_for_each(|name| state.section(name, |part| part(1, Some(&[number]))))
        });
        both.unwrap();
    };
    save_both(1);
    let map = MapFolder::open(&folder).unwrap();
    let first = map.state("a").unwrap().next().unwrap().unwrap();
    assert_eq!(first, (1, vec![1]));
    save_both(2);
    // What was saved first is gone, or is read.
    let second = map.state("b").unwrap().next().unwrap();
    assert!(second.as_ref().map_or(true, |second| *second == first), "{second:?}");
    // A map that has not been asked for its state before the folder was replaced has none.
    let map = MapFolder::open(&folder).unwrap();
    save_both(3);
    let late = map.state("a");
    assert!(matches!(late, Err(Error::Malformed { .. })), "{late:?}");
}

/// Regression: between two renames of the writer a reader found no map.
#[test]
fn a_map_that_is_saved_again_and_again_can_always_be_opened() {
    let parent = tempfile::tempdir().unwrap();
    let folder = parent.path().join("map");
    let mut saver = MapFolderSaver::create(&folder).unwrap();
    save_number(&mut saver, 0);
    let ended = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        let reader = scope.spawn(|| {
            while !ended.load(std::sync::atomic::Ordering::Relaxed) {
                MapFolder::open(&folder).unwrap();
            }
        });
        (1..200).for_each(|number| save_number(&mut saver, number));
        ended.store(true, std::sync::atomic::Ordering::Relaxed);
        reader.join().unwrap();
    });
}
