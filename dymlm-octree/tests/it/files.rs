//! The files: round trips, damaged ones, and OctoMap's own tools.

use std::process::Command;

use crate::common::{Random, config, double, leaves_of};
use dymlm_octree::{CellState, Error, Octree, OctreeConfig};
use proptest::prelude::*;

fn sample(colored: bool) -> Octree {
    let mut config = config(0.25, 4.0);
    if colored {
        config.color = true;
    }
    let mut map = Octree::new(config).unwrap();
    let mut random = Random(31);
    for _ in 0..3 {
        let origin = random.point(0.3);
        let points: Vec<_> = (0..15).map(|_| random.point(1.5)).collect();
        let colors: Vec<_> = (0..15).map(|i| [i * 10, i, 200 - i]).collect();
        map.insert_scan_colored(double(origin), &points, &colors).unwrap();
    }
    map
}

fn ot(map: &Octree) -> Vec<u8> {
    let mut file = Vec::new();
    map.write_ot(&mut file).unwrap();
    file
}

fn bt(map: &Octree) -> Vec<u8> {
    let mut file = Vec::new();
    map.write_bt(&mut file).unwrap();
    file
}

fn read_ot(file: &[u8]) -> Result<Octree, Error> {
    Octree::read_ot(file, OctreeConfig::default())
}

fn read_bt(file: &[u8]) -> Result<Octree, Error> {
    Octree::read_bt(file, OctreeConfig::default())
}

#[test]
fn ot_keeps_everything() {
    for colored in [false, true] {
        let map = sample(colored);
        let again = read_ot(&ot(&map)).unwrap();
        assert!(again.leaves().eq(map.leaves()));
        assert_eq!(again.config().color, map.config().color);
        assert_eq!(ot(&again), ot(&map));
    }
}

#[test]
fn bt_keeps_the_states() {
    let map = sample(true);
    let before = ot(&map);
    let again = read_bt(&bt(&map)).unwrap();
    assert_eq!(ot(&map), before, "writing changed the map");
    for leaf in map.leaves() {
        assert_eq!(again.state(leaf.center), leaf.state);
    }
    let cells = |map: &Octree| -> usize { map.leaves().map(|leaf| 1 << (3 * (16 - leaf.depth))).sum() };
    assert_eq!(cells(&again), cells(&map));
    assert_eq!(bt(&again), bt(&map));
}

#[test]
fn empty_maps_are_files_too() {
    let map = Octree::new(config(0.1, 1.0)).unwrap();
    assert!(read_ot(&ot(&map)).unwrap().is_empty());
    assert!(read_bt(&bt(&map)).unwrap().is_empty());
}

/// A reader can hold other things after the tree.
#[test]
fn nothing_is_read_beyond_the_tree() {
    let map = sample(false);
    for (mut file, binary) in [(ot(&map), false), (bt(&map), true)] {
        file.extend(b"more");
        let mut reader = file.as_slice();
        if binary {
            Octree::read_bt(&mut reader, OctreeConfig::default()).unwrap();
        } else {
            Octree::read_ot(&mut reader, OctreeConfig::default()).unwrap();
        }
        assert_eq!(reader, b"more");
    }
}

#[test]
fn every_truncated_file_is_an_error() {
    for colored in [false, true] {
        let map = sample(colored);
        let file = ot(&map);
        for end in 0..file.len() {
            assert!(matches!(read_ot(&file[..end]), Err(Error::Malformed(_))), "{end} of {}", file.len());
        }
        let file = bt(&map);
        for end in 0..file.len() {
            assert!(matches!(read_bt(&file[..end]), Err(Error::Malformed(_))), "{end} of {}", file.len());
        }
    }
}

#[test]
fn headers_that_lie_are_errors() {
    let header = |text: &str| format!("# Octomap OcTree file\n{text}data\n\0\0\0\0\0");
    let message = |text: &str| read_ot(header(text).as_bytes()).unwrap_err().to_string();
    assert!(read_ot(header("id OcTree\nsize 1\nres 0.1\n").as_bytes()).is_ok());
    assert!(
        read_ot(header("# any comment \u{e9}\nid OcTree size 1 res 0.1\nfuture keyword\n").as_bytes())
            .is_ok()
    );
    assert!(message("id OcTree\nsize 2\nres 0.1\n").contains("1 nodes, but its header says 2"));
    assert!(message("id OcTree\nsize 18446744073709551615\nres 0.1\n").contains("1 nodes"));
    assert!(message("id OcTree\nsize -1\nres 0.1\n").contains("no valid size"));
    assert!(message("id OcTree\nsize 1\n").contains("no valid res"));
    assert!(message("size 1\nres 0.1\n").contains("no valid id"));
    for resolution in ["0", "-1", "nan", "inf", "1e300"] {
        let text = header(&format!("id OcTree\nsize 1\nres {resolution}\n"));
        assert!(matches!(read_ot(text.as_bytes()), Err(Error::Config(_))), "{resolution}");
    }
    let other = header("id OcTreeStamped\nsize 1\nres 0.1\n");
    assert!(matches!(read_ot(other.as_bytes()), Err(Error::UnsupportedTree(id)) if id == "OcTreeStamped"));
    assert!(matches!(read_bt(&ot(&sample(false))), Err(Error::Malformed(_))));
    assert!(matches!(read_ot(&bt(&sample(false))), Err(Error::Malformed(_))));
    assert!(matches!(read_ot(&vec![b'#'; 1 << 20]), Err(Error::Malformed(_))));
}

/// One node after the other, each with a child: deeper than an octree can be.
#[test]
fn trees_deeper_than_sixteen_levels_are_errors() {
    let mut deep = b"# Octomap OcTree file\nid OcTree\nsize 100\nres 0.1\ndata\n".to_vec();
    deep.extend([0, 0, 0, 0, 1].repeat(100_000));
    assert!(read_ot(&deep).unwrap_err().to_string().contains("below depth 16"));
    let mut deep = b"# Octomap OcTree binary file\nid OcTree\nsize 100\nres 0.1\ndata\n".to_vec();
    deep.extend([3, 0].repeat(100_000));
    assert!(read_bt(&deep).unwrap_err().to_string().contains("below depth 16"));
}

#[test]
fn values_that_are_no_log_odds_are_errors() {
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        let mut file = b"# Octomap OcTree file\nid OcTree\nsize 1\nres 0.1\ndata\n".to_vec();
        file.extend(value.to_le_bytes());
        file.push(0);
        assert!(matches!(read_ot(&file), Err(Error::Malformed(_))));
    }
    let empty_inner = b"# Octomap OcTree binary file\nid OcTree\nsize 1\nres 0.1\ndata\n\0\0";
    assert!(matches!(read_bt(empty_inner), Err(Error::Malformed(_))));
}

/// The whole map as one leaf: memory does not grow with the space that leaves cover.
#[test]
fn huge_leaves_cost_no_memory() {
    let mut file = b"# Octomap OcTree file\nid OcTree\nsize 1\nres 0.1\ndata\n".to_vec();
    file.extend(1.0_f32.to_le_bytes());
    file.push(0);
    let map = read_ot(&file).unwrap();
    assert_eq!((map.counts().nodes, map.counts().leaves), (1, 1));
    assert!(map.memory_bytes() < 100_000);
    assert_eq!(map.state([3000.0, -3000.0, 3276.0]), CellState::Occupied);
    assert_eq!(map.leaves().next().unwrap().size, 6553.6);
    assert_eq!(ot(&map), ot(&read_ot(&ot(&map)).unwrap()));
    assert_eq!(leaves_of(&read_bt(&bt(&map)).unwrap()).len(), 1);
    // Scans can be inserted into it as into any other map.
    let mut map = map;
    map.insert_scan([0.0; 3], &[[1.0, 0.0, 0.0]]).unwrap();
    assert_eq!(map.log_odds([3000.0; 3]), Some(1.0));
    assert!(map.log_odds([0.5, 0.0, 0.0]).unwrap() < 1.0);
}

/// A tree that was written unpruned (`OctoMap`'s lazy evaluation) is the same map.
#[test]
fn unpruned_trees_are_pruned() {
    let mut file = b"# Octomap OcTree file\nid OcTree\nsize 9\nres 0.1\ndata\n".to_vec();
    file.extend([0, 0, 0, 0, 0xFF]);
    file.extend([0, 0, 0x80, 0x3F, 0].repeat(8));
    let map = read_ot(&file).unwrap();
    assert_eq!(map.counts().nodes, 1);
    assert_eq!(map.log_odds([1.0; 3]), Some(1.0));
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    /// Damaged bytes give an error or another map, never a panic.
    #[test]
    fn damaged_files_do_no_harm(position in 0..2000_usize, byte: u8, colored: bool) {
        let map = sample(colored);
        for (mut file, read) in [(ot(&map), read_ot as fn(&[u8]) -> _), (bt(&map), read_bt)] {
            let position = position % file.len();
            file[position] = byte;
            if let Ok(map) = read(&file) {
                let _ = (map.counts(), map.leaves().count());
            }
        }
    }
}

/// Regression: the link was replaced by the file, and what it led to stayed as it was.
#[cfg(unix)]
#[test]
fn a_link_is_followed() {
    let folder = tempfile::tempdir().unwrap();
    let [file, link] = ["map.bt", "latest.bt"].map(|name| folder.path().join(name));
    std::fs::write(&file, "old").unwrap();
    std::os::unix::fs::symlink("map.bt", &link).unwrap();
    sample(false).save_bt(&link).unwrap();
    assert!(link.is_symlink());
    assert!(Octree::load_bt(&file, OctreeConfig::default()).is_ok());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
}

#[test]
fn files_are_named_in_errors() {
    let folder = tempfile::tempdir().unwrap();
    let missing = folder.path().join("missing.ot");
    let error = Octree::load_ot(&missing, OctreeConfig::default()).unwrap_err();
    assert!(error.to_string().contains("missing.ot"), "{error}");
    let broken = folder.path().join("broken.bt");
    std::fs::write(&broken, "nonsense").unwrap();
    let error = Octree::load_bt(&broken, OctreeConfig::default()).unwrap_err();
    assert!(error.to_string().contains("broken.bt"), "{error}");
    let nowhere = folder.path().join("no folder").join("map.ot");
    assert!(matches!(sample(false).save_ot(&nowhere), Err(Error::Io { .. })));
    assert!(matches!(sample(false).save_bt(&nowhere), Err(Error::Io { .. })));
    let path = folder.path().join("map.ot");
    sample(true).save_ot(&path).unwrap();
    assert!(Octree::load_ot(&path, OctreeConfig::default()).unwrap().leaves().eq(sample(true).leaves()));
}

/// Runs one of OctoMap's tools; `None` (and a printed line) when it is not installed.
fn tool(name: &str, arguments: &[&std::path::Path]) -> Option<String> {
    let Ok(output) = Command::new(name).args(arguments).output() else {
        eprintln!("skipped: {name} is not installed");
        return None;
    };
    let text = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
    assert!(output.status.success(), "{name}: {text}");
    Some(text)
}

#[test]
fn octomaps_tools_read_our_files() {
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    let map = sample(false);
    map.save_ot(path("map.ot")).unwrap();
    map.save_bt(path("map.bt")).unwrap();
    sample(true).save_ot(path("colored.ot")).unwrap();

    // .bt to VRML: one box for each occupied leaf.
    if tool("bt2vrml", &[&path("map.bt")]).is_some() {
        let vrml = std::fs::read_to_string(path("map.bt.wrl")).unwrap();
        let occupied = read_bt(&bt(&map)).unwrap().counts().occupied_leaves;
        assert_eq!(vrml.matches("Box").count(), occupied);
    }
    // .ot and coloured .ot, converted to .bt by OctoMap, have the leaves of our own .bt.
    for name in ["map", "colored"] {
        let converted = path("converted.bt");
        if tool("convert_octree", &[&path(&format!("{name}.ot")), &converted]).is_some() {
            let theirs = Octree::load_bt(&converted, OctreeConfig::default()).unwrap();
            assert_eq!(leaves_of(&theirs), leaves_of(&read_bt(&bt(&map)).unwrap()), "{name}");
        }
    }
    // Our .ot against the same map written by OctoMap: the divergence is 0.
    if tool("convert_octree", &[&path("map.ot"), &path("again.ot")]).is_some() {
        let report = tool("compare_octrees", &[&path("map.ot"), &path("again.ot")]);
        assert!(report.is_none_or(|report| report.contains("KLD: 0\n")));
    }
}
