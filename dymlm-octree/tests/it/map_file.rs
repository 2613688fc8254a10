//! Maps in the files of ROS `map_server`: what is written is read again, values mean what `map_server` says, and what is
//! no map is refused with a reason.

use crate::common::config;
use CellState::{Free, Occupied, Unknown};
use dymlm_octree::{CellState, Error, MapFile, Octree};
use proptest::prelude::*;

const YAML: &str = "image: a.pgm\nmode: trinary\nresolution: 0.05\norigin: [-1.5, 2.0, 0.1]\nnegate: 0\n\
                    occupied_thresh: 0.65\nfree_thresh: 0.196\n";

/// The description with one line replaced.
fn with(key: &str, line: &str) -> String {
    let lines = YAML.lines().map(|old| if old.starts_with(&format!("{key}:")) { line } else { old });
    lines.collect::<Vec<_>>().join("\n")
}

fn reason(yaml: &str, image: &[u8]) -> String {
    MapFile::read(yaml, image).unwrap_err().to_string()
}

#[test]
fn what_is_written_is_read_again() {
    let mut map = Octree::new(config(0.25, 5.0)).unwrap();
    for (k, value) in [1.0, -1.0, 1.0, -1.0].into_iter().enumerate() {
        map.set_log_odds([0.6 * k as f64 - 3.1, 0.9 * k as f64, 0.1], Some(value));
    }
    let grid = map.project([0.0, 0.0, 1.0], 0.0, 0.5).unwrap();
    let folder = tempfile::tempdir().unwrap();
    // Whatever a name holds is quoted.
    for name in ["hall", "a # b", "it's \"one\"", "back\\slash"] {
        grid.save(folder.path(), name).unwrap();
        let read = MapFile::load(folder.path().join(format!("{name}.yaml"))).unwrap();
        assert_eq!((read.width, read.height), (grid.width(), grid.height()));
        assert_eq!(read.resolution, grid.resolution());
        assert_eq!(read.origin, [grid.origin()[0], grid.origin()[1], 0.0]);
        assert_eq!(read.cells, grid.cells());
    }
    // The description names the image beside it, wherever both lie.
    std::fs::create_dir(folder.path().join("floor 1")).unwrap();
    grid.save(folder.path(), "floor 1/map").unwrap();
    let read = MapFile::load(folder.path().join("floor 1/map.yaml")).unwrap();
    assert_eq!(read.cells, grid.cells());
}

#[test]
fn values_mean_what_map_server_says() {
    // The upper row comes first.
    let image = b"P5\n# made by hand\n3 2\n255\n\x00\xcd\xfe\xff\x59\x5a";
    let map = MapFile::read(YAML, image).unwrap();
    assert_eq!((map.width, map.height, map.resolution, map.origin), (3, 2, 0.05, [-1.5, 2.0, 0.1]));
    // 0x59 = 89 is occupied by (255 - 89) / 255 = 0.651, 0x5a by 0.647; 205 by 0.19608 is not below 0.196.
    assert_eq!(map.cells, [Free, Occupied, Unknown, Occupied, Unknown, Free]);
    let negated = MapFile::read(&with("negate", "negate: 1"), image).unwrap();
    assert_eq!(negated.cells, [Occupied, Unknown, Unknown, Free, Occupied, Occupied]);
    let text = b"P2 3 2 100 # in per cent\n0 80 99\n100 34 36\n";
    assert_eq!(MapFile::read(YAML, text).unwrap().cells, [Free, Occupied, Unknown, Occupied, Unknown, Free]);
    let wide = b"P5 2 1 65535\n\xff\xff\x00\x01";
    assert_eq!(MapFile::read(YAML, wide).unwrap().cells, [Free, Occupied]);
    assert_eq!(MapFile::read(YAML, b"P5 0 0 255\n").unwrap().cells, []);
}

#[test]
fn descriptions_as_other_programs_write_them_are_read() {
    let yaml = "%YAML 1.2\n---\n# a comment\n\"image\": 'it''s.pgm'  # the image\nresolution: 5.0e-2\norigin:\n- -1.5\n\
                - 2\n- 0.1\nnegate: false\noccupied_thresh: 0.65\nfree_thresh: 0.196\nsomething: else\n";
    let image = b"P5 1 1 255\n\x00";
    assert_eq!(MapFile::read(yaml, image).unwrap(), MapFile::read(YAML, image).unwrap());
}

#[test]
fn what_is_no_map_is_refused_with_a_reason() {
    let image = b"P5 1 1 255\n\x00";
    for (key, line, expected) in [
        ("image", "", "there is no image"),
        ("image", "image:", "image names no file"),
        ("mode", "mode: scale", "the mode \"scale\" is not supported, only trinary"),
        ("resolution", "resolution: wide", "resolution is \"wide\", which is no number"),
        ("resolution", "resolution: 0", "resolution is 0 m, which is not positive"),
        ("resolution", "resolution: .nan", "resolution is \".nan\", which is no number"),
        ("resolution", "resolution: inf", "resolution is \"inf\", which is no number"),
        ("origin", "origin: [1, 2]", "origin is \"[1, 2]\", not a list of x, y and yaw"),
        ("origin", "origin: 5", "origin is \"5\", not a list of x, y and yaw"),
        ("origin", "origin: [1, 2, inf]", "origin is \"[1, 2, inf]\", not a list of x, y and yaw"),
        ("negate", "negate: 2", "negate is \"2\", not 0 or 1"),
        ("negate", "- 2", "origin is \"[-1.5, 2.0, 0.1, 2]\", not a list of x, y and yaw"),
        ("image", "- 2", "line 1 is no key with a value: \"- 2\""),
        ("mode", "- 2", "line 2 is an item of no list"),
        ("negate", "something", "line 5 is no key with a value: \"something\""),
        ("negate", "image: b.pgm", "there are two image"),
        ("free_thresh", "free_thresh: 0.7", "does not hold for 0.7 and 0.65"),
        ("occupied_thresh", "", "there is no occupied_thresh"),
    ] {
        let reason = reason(&with(key, line), image);
        assert!(reason.contains(expected), "{line:?}: {reason}");
    }
    for (image, expected) in [
        (&b""[..], "no PGM file"),
        (b"\x89PNG", "no PGM file"),
        (b"P5 3", "header ends"),
        (b"P5 3 -1 255\n", "header ends"),
        (b"P5 2 2 255\n\x00\x00\x00", "ends after 3 of its 2x2 pixels"),
        (b"P2 2 2 255 1 2 x 3", "ends after 2 of its 2x2 pixels"),
        (b"P5 2 2 0\n\x00\x00\x00\x00", "greatest value is 0"),
        (b"P5 2 2 70000\n\x00\x00\x00\x00", "greatest value is 70000"),
        (b"P2 1 1 9 10", "a pixel of the image is 10, greater than 9"),
        (b"P5 4000000000 4000000000 255\n", "larger than 2^28 cells"),
    ] {
        let reason = reason(YAML, image);
        assert!(reason.contains(expected), "{image:?}: {reason}");
    }
    let folder = tempfile::tempdir().unwrap();
    let yaml = folder.path().join("a.yaml");
    let of_file = || MapFile::load(&yaml).unwrap_err().to_string();
    assert!(of_file().contains("a.yaml"));
    std::fs::write(&yaml, YAML).unwrap();
    assert!(of_file().contains("a.pgm"));
    std::fs::write(folder.path().join("a.pgm"), b"GIF").unwrap();
    assert!(of_file().contains("a.pgm") && of_file().contains("no PGM file"), "{}", of_file());
    std::fs::write(&yaml, b"\xff\xfe").unwrap();
    assert!(of_file().contains("a.yaml") && of_file().contains("no text"), "{}", of_file());
    assert!(matches!(MapFile::load(&yaml), Err(Error::File { .. })));
}

proptest! {
    #[test]
    fn no_bytes_make_it_panic(yaml in "\\PC{0,60}", tail in proptest::collection::vec(any::<u8>(), 0..60)) {
        let _ = MapFile::read(&yaml, &tail);
        let _ = MapFile::read(&format!("{YAML}{yaml}"), &[b"P5 3 2 255\n", &tail[..]].concat());
        let _ = MapFile::read(YAML, &[b"P2 ", &tail[..]].concat());
    }
}

#[test]
fn an_apostrophe_in_a_name_opens_no_quotes() {
    let folder = tempfile::tempdir().unwrap();
    let image = b"P2 1 1 255 0";
    for (written, name) in [
        ("bob's.pgm # hall", "bob's.pgm"),
        ("'bob''s # 1.pgm' # hall", "bob's # 1.pgm"),
        ("\"a \\\" # b.pgm\" # hall", "a \" # b.pgm"),
    ] {
        std::fs::write(folder.path().join(name), image).unwrap();
        let yaml = folder.path().join("map.yaml");
        std::fs::write(&yaml, with("image", &format!("image: {written}"))).unwrap();
        let map = MapFile::load(&yaml).unwrap_or_else(|error| panic!("{written}: {error}"));
        assert_eq!(map.cells, [Occupied], "{written}");
    }
}
