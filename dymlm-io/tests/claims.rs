//! Small files that claim large contents, and lists whose entries are all the same: tested by the memory that
//! they allocate and the growth of the time.
#![allow(clippy::unwrap_used, reason = "tests")]

#[allow(dead_code, reason = "of what spoils a dataset not all is needed here")]
#[path = "it/common/mod.rs"]
mod common;

use std::alloc::System;
use std::fmt::Write as _;
use std::fs;

use common::Dataset;
use dymlm_io::{
    DetectionFile, Error, MAX_IMAGE_PIXELS, TumDataset, TumOptions, decode_pcd, decode_ply, read_color_image,
    read_depth_png, write_depth_png, write_png,
};
use dymlm_test_support::growth;
use stats_alloc::{INSTRUMENTED_SYSTEM, Region, StatsAlloc};

#[global_allocator]
static ALLOCATOR: &StatsAlloc<System> = &INSTRUMENTED_SYSTEM;

/// The given number of different names of fields or properties.
fn names(count: usize) -> String {
    (0..count).fold(String::new(), |mut names, i| {
        write!(names, " f{i}").unwrap();
        names
    })
}

fn pcd(fields: usize) -> String {
    let all = |value: &str| format!(" {value}").repeat(fields);
    let (names, sizes, types) = (names(fields), all("4"), all("F"));
    format!(
        "VERSION .7\nFIELDS x y z{names}\nSIZE 4 4 4{sizes}\nTYPE F F F{types}\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n0 0 0{}\n",
        all("1")
    )
}

fn ply(properties: usize) -> String {
    let further = names(properties).replace(' ', "\nproperty float ");
    let values = " 1".repeat(properties);
    format!(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z{further}\nend_header\n\
         0 0 0{values}\n"
    )
}

#[test]
fn headers_take_as_long_as_they_are() {
    const MOST: f64 = 24.0;
    let times = growth(MOST, &pcd(4_000), &pcd(32_000), |file| {
        assert_eq!(decode_pcd(file.as_bytes(), "test.pcd").unwrap().cloud.len(), 1);
    });
    assert!(times <= MOST, "PCD: 8 times the fields took {times} times as long");
    let times = growth(MOST, &ply(4_000), &ply(32_000), |file| {
        assert_eq!(decode_ply(file.as_bytes(), "test.ply").unwrap().len(), 1);
    });
    assert!(times <= MOST, "PLY: 8 times the properties took {times} times as long");
}

#[test]
fn frames_of_one_time_take_as_much_as_others() {
    const FRAMES: usize = 5_000;
    let dataset = Dataset::new();
    for name in ["rgb", "depth"] {
        let list = (0..FRAMES).fold(String::new(), |mut list, i| {
            writeln!(list, "100.0 {name}/{}.png", i % 4).unwrap();
            list
        });
        dataset.write(&format!("{name}.txt"), &list);
    }
    let region = Region::new(ALLOCATOR);
    let opened = TumDataset::open(dataset.folder.path(), &TumOptions::default()).unwrap();
    assert_eq!(opened.frames().len(), FRAMES);
    // Other tests allocate some ten megabytes at the same time; a list of all pairs would take 400.
    let allocated = region.change().bytes_allocated;
    assert!(allocated < 100 << 20, "{allocated} bytes");
}

/// Makes a PNG claim another width and height than it has pixels for.
fn claim(path: &std::path::Path, sides: [u32; 2]) {
    let mut file = fs::read(path).unwrap();
    for (place, side) in [16, 20].into_iter().zip(sides) {
        file[place..place + 4].copy_from_slice(&side.to_be_bytes());
    }
    let checksum = crc32fast::hash(&file[12..29]);
    file[29..33].copy_from_slice(&checksum.to_be_bytes());
    fs::write(path, file).unwrap();
}

#[test]
fn images_are_refused_by_their_size_before_they_are_decoded() {
    let folder = tempfile::tempdir().unwrap();
    let (color, depth) = (folder.path().join("color.png"), folder.path().join("depth.png"));
    write_png(&color, 16, 12, &common::colors(0)).unwrap();
    write_depth_png(&depth, &common::depth(0), 5000.0).unwrap();
    claim(&color, [16_384, 16_384]);
    claim(&depth, [16_384, 16_384]);
    let region = Region::new(ALLOCATOR);
    let refused = [read_color_image(&color).map(|_| ()), read_depth_png(&depth, 5000.0).map(|_| ())];
    for refused in refused {
        let Err(Error::Malformed { reason, .. }) = refused else { panic!("{refused:?}") };
        assert!(reason.contains(&MAX_IMAGE_PIXELS.to_string()), "{reason}");
    }
    let allocated = region.change().bytes_allocated;
    assert!(allocated < 200 << 20, "{allocated} bytes");
}

#[test]
fn images_of_a_dataset_are_refused_by_the_cameras_size() {
    let dataset = Dataset::new();
    claim(&dataset.path("rgb/0.png"), [8_192, 4_096]);
    claim(&dataset.path("depth/1.png"), [8_192, 4_096]);
    let opened = TumDataset::open(dataset.folder.path(), &TumOptions::default()).unwrap();
    for frame in 0..2 {
        let refused = opened.load(frame).unwrap_err();
        let Error::Listed { fault, .. } = refused else { panic!("{refused:?}") };
        assert!(matches!(*fault, Error::ImageSize { actual_width: 8_192, .. }), "{fault:?}");
    }
}

/// A deflated stream of zeros: 1.6 bytes for each 258 of them.
fn deflated_zeros(bytes: usize) -> Vec<u8> {
    let mut deflated = vec![0x78, 0x01, 0];
    let mut bits = 0;
    let mut push = |bit: bool| {
        if bits == 8 {
            deflated.push(0);
            bits = 0;
        }
        *deflated.last_mut().unwrap() |= u8::from(bit) << bits;
        bits += 1;
    };
    // A last block with fixed codes: a zero, then runs of 258 bytes that repeat the byte before.
    let mut code = |code: &str| code.bytes().for_each(|bit| push(bit == b'1'));
    code("110");
    code("00110000");
    (0..bytes / 258).for_each(|_| code("1100010100000"));
    code("0000000");
    deflated
}

/// Puts a chunk behind a PNG's header.
fn add_chunk(path: &std::path::Path, name: &[u8], content: &[u8]) {
    let mut file = fs::read(path).unwrap();
    let mut chunk = (content.len() as u32).to_be_bytes().to_vec();
    let named = [name, content].concat();
    chunk.extend_from_slice(&named);
    chunk.extend_from_slice(&crc32fast::hash(&named).to_be_bytes());
    file.splice(33..33, chunk);
    fs::write(path, file).unwrap();
}

#[test]
fn colour_profiles_that_inflate_without_end_are_passed_over() {
    let folder = tempfile::tempdir().unwrap();
    let (color, depth) = (folder.path().join("color.png"), folder.path().join("depth.png"));
    write_png(&color, 16, 12, &common::colors(0)).unwrap();
    write_depth_png(&depth, &common::depth(0), 5000.0).unwrap();
    let (colors, depths) = (read_color_image(&color).unwrap(), read_depth_png(&depth, 5000.0).unwrap());
    let profile = [b"p\0\0", &deflated_zeros(1 << 28)[..]].concat();
    add_chunk(&color, b"iCCP", &profile);
    add_chunk(&depth, b"iCCP", &profile);
    let region = Region::new(ALLOCATOR);
    assert_eq!(read_color_image(&color).unwrap().data(), colors.data());
    assert_eq!(read_depth_png(&depth, 5000.0).unwrap(), depths);
    let allocated = region.change().bytes_allocated;
    assert!(allocated < 250 << 20, "{allocated} bytes");
}

/// 8 MB a mask when it is decoded, in a line of 120 bytes.
#[test]
fn masks_are_decoded_when_their_frame_is_asked_for() {
    let mut lines = String::new();
    for index in 0..50 {
        let head = format!("{{\"timestamp\": {index}, \"detections\": [{{\"label\": \"a\", \"score\": 1");
        let mask = "\"mask\": {\"size\": [8192, 8192], \"counts\": [67108863, 1]}";
        writeln!(lines, "{head}, \"bbox\": [0, 0, 1, 1], {mask}}}]}}").unwrap();
    }
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("detections.jsonl");
    fs::write(&path, lines).unwrap();
    let region = Region::new(ALLOCATOR);
    let file = DetectionFile::open(&path, 0.02).unwrap();
    let found = file.at(7.0).unwrap().unwrap();
    let mask = found[0].mask().unwrap();
    assert!(mask.count() == 1 && mask.at(8_191, 8_191));
    let allocated = region.change().bytes_allocated;
    assert!(allocated < 250 << 20, "{allocated} bytes");
}
