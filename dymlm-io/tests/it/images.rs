//! Pictures and depth images as files.
use std::fs;

use dymlm_core::DepthImage;
use dymlm_io::{Error, read_color_image, read_depth_png, write_depth_png, write_png};
use proptest::prelude::*;

#[test]
fn depth_beyond_16_bits_is_no_reading() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("depth.png");
    let depth = DepthImage::new(5, 1, vec![0.0, 13.107, 13.1072, 1e30, 0.00009]).unwrap();
    write_depth_png(&path, &depth, 5000.0).unwrap();
    let read = read_depth_png(&path, 5000.0).unwrap();
    assert_eq!(read.data(), [0.0, 65535.0 * 2e-4, 0.0, 0.0, 0.0]);
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(write_depth_png(&path, &depth, scale), Err(Error::Malformed { .. })));
        assert!(matches!(read_depth_png(&path, scale), Err(Error::Malformed { .. })));
    }
}

#[test]
fn refuses_buffers_that_are_no_picture() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    for (width, height, length) in [(2, 2, 3), (0, 0, 0), (0, 5, 0), (usize::MAX, 2, 4), (1 << 33, 1, 1)] {
        let refused = write_png(&path, width, height, &vec![[0; 3]; length]);
        assert!(matches!(refused, Err(Error::BufferLength { .. })), "{width}x{height}");
    }
    assert!(!path.exists());
}

#[test]
fn reads_pictures_of_other_pixel_formats() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("picture.png");
    image::GrayImage::from_raw(2, 1, vec![7, 200]).unwrap().save(&path).unwrap();
    assert_eq!(read_color_image(&path).unwrap().data(), [[7; 3], [200; 3]]);
    image::RgbaImage::from_raw(1, 1, vec![1, 2, 3, 9]).unwrap().save(&path).unwrap();
    assert_eq!(read_color_image(&path).unwrap().data(), [[1, 2, 3]]);
    fs::write(&path, "no picture").unwrap();
    assert!(matches!(read_color_image(&path), Err(Error::Malformed { .. })));
    assert!(matches!(read_color_image(folder.path().join("none.png")), Err(Error::Io { .. })));
}

/// The PNG's header claims 2^31 x 2^31 pixels.
#[test]
fn absurd_sizes_take_no_memory() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("depth.png");
    write_depth_png(&path, &DepthImage::new(2, 2, vec![1.0; 4]).unwrap(), 1000.0).unwrap();
    let mut bytes = fs::read(&path).unwrap();
    for at in [16, 20] {
        bytes[at..at + 4].copy_from_slice(&0x7fff_ffff_u32.to_be_bytes());
    }
    let checksum = crc32fast::hash(&bytes[12..29]);
    bytes[29..33].copy_from_slice(&checksum.to_be_bytes());
    fs::write(&path, bytes).unwrap();
    assert!(matches!(read_depth_png(&path, 1000.0), Err(Error::Malformed { .. })));
    assert!(matches!(read_color_image(&path), Err(Error::Malformed { .. })));
}

proptest! {
    // Few cases, since atomic files are flushed to the disk, which is slow.
    #![proptest_config(ProptestConfig::with_cases(16))]

    #[test]
    fn reads_what_it_wrote(width in 1..20_usize, stored in prop::collection::vec(any::<u16>(), 1..200)) {
        let folder = tempfile::tempdir().unwrap();
        let height = stored.len().div_ceil(width);
        let mut stored = stored;
        stored.resize(width * height, 0);
        for scale in [5000.0, 1000.0, 256.0] {
            let path = folder.path().join("depth.png");
            let depth = DepthImage::from_u16(width, height, &stored, scale).unwrap();
            write_depth_png(&path, &depth, scale).unwrap();
            prop_assert_eq!(&read_depth_png(&path, scale).unwrap(), &depth);
        }
        let path = folder.path().join("picture.png");
        let colors: Vec<[u8; 3]> = stored.iter().map(|&s| [s as u8, (s >> 8) as u8, (s >> 4) as u8]).collect();
        write_png(&path, width, height, &colors).unwrap();
        prop_assert_eq!(read_color_image(&path).unwrap().into_data(), colors);
    }
}
