//! PCD: files by `Open3D`, round trips, bad files.
use std::fs;

use dymlm_core::{PointCloud, Pose};
use dymlm_io::{Error, PcdCloud, decode_pcd, encode_pcd, read_pcd};
use proptest::prelude::*;

const OPEN3D: [&str; 3] = ["open3d_ascii.pcd", "open3d_binary.pcd", "open3d_compressed.pcd"];

fn path(name: &str) -> String {
    format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"))
}

/// `data/make_clouds.py` made these.
#[test]
fn reads_what_open3d_wrote() {
    for name in OPEN3D {
        let cloud = read_pcd(path(name)).unwrap();
        assert_eq!((cloud.width, cloud.height, cloud.cloud.len()), (12, 1, 12));
        for i in 0..12 {
            let t = i as f64;
            let expected = [0.25 * t - 1.0, 0.1 * t * t, 2.0 - t / 3.0];
            let found = cloud.cloud.points()[i];
            for axis in 0..3 {
                assert!((f64::from(found[axis]) - expected[axis]).abs() < 1e-5, "{name}: {found:?}");
            }
            let i = i as u8;
            assert_eq!(cloud.cloud.colors().unwrap()[i as usize], [20 * i, 255 - 20 * i, 7 * i + 1]);
        }
        let names: Vec<&str> = cloud.fields.iter().map(|field| field.name.as_str()).collect();
        assert_eq!(names, ["normal_x", "normal_y", "normal_z"]);
        assert_eq!(cloud.field("normal_z").unwrap().values, [1.0; 12]);
        assert_eq!(cloud.viewpoint, Pose::identity());
    }
}

fn decode(text: impl AsRef<[u8]>) -> Result<PcdCloud, Error> {
    decode_pcd(text.as_ref(), "test.pcd")
}

const HEADER: &str = "# .PCD v0.7\nVERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 2\nHEIGHT 1\n\
    VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 2\nDATA ascii\n";

#[test]
fn reads_an_organized_cloud_with_pixels_that_have_no_reading() {
    let text = "FIELDS x y _ z rgb label\nSIZE 8 4 1 4 4 2\nTYPE F F U F F I\nCOUNT 1 1 3 1 1 1\nWIDTH 2\nHEIGHT 2\n\
        VIEWPOINT 1 2 3 0 1 0 0\nDATA ascii\n0.5 1 9 9 9 2 4.2108e+06 -1\nnan nan 0 0 0 nan 0 0\n\
        1 1 0 0 0 1 4278255360 3\r\n\n-1 -1 0 0 0 -1 255 4\n";
    let cloud = decode(text).unwrap();
    assert_eq!((cloud.width, cloud.height), (2, 2));
    assert_eq!(cloud.viewpoint, Pose::new([1.0, 2.0, 3.0], [1.0, 0.0, 0.0, 0.0]).unwrap());
    assert_eq!(cloud.cloud.points()[0], [0.5, 1.0, 2.0]);
    assert!(cloud.cloud.points()[1][0].is_nan());
    // A float's bits, or the bits as a number: 4.2108e6 is 0x4a8080e0, 4278255360 0xff00ff00.
    assert_eq!(cloud.cloud.colors().unwrap(), [[0x80, 0x80, 0xe0], [0; 3], [0, 255, 0], [0, 0, 255]]);
    assert_eq!(cloud.field("label").unwrap().values, [-1.0, 0.0, 3.0, 4.0]);
    assert!(cloud.field("_").is_none());
    let finite = cloud.finite();
    assert_eq!(finite.points(), [[0.5, 1.0, 2.0], [1.0; 3], [-1.0; 3]]);
    assert_eq!(finite.colors().unwrap().len(), 3);
}

/// What version 0.5 called the fields.
#[test]
fn reads_columns_as_fields() {
    let old = HEADER.replace("VERSION .7\nFIELDS", "VERSION .5\nCOLUMNS");
    let cloud = decode(old + "1 2 3\n4 5 6\n").unwrap();
    assert_eq!(cloud.cloud.points(), [[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]]);
}

#[test]
fn reads_binary_with_padding_between_the_fields() {
    let mut bytes =
        b"FIELDS x y z _ intensity\nSIZE 4 4 4 1 8\nTYPE F F F U F\nCOUNT 1 1 1 4 2\nPOINTS 2\nDATA binary\n"
            .to_vec();
    for i in 0..2 {
        (0..3).for_each(|axis| bytes.extend(((10 * i + axis) as f32).to_le_bytes()));
        bytes.extend([0xff; 4]);
        (0..2).for_each(|k| bytes.extend((f64::from(i) + 0.5 * f64::from(k)).to_le_bytes()));
    }
    let cloud = decode(&bytes).unwrap();
    assert_eq!(cloud.cloud.points(), [[0.0, 1.0, 2.0], [10.0, 11.0, 12.0]]);
    let intensity = cloud.field("intensity").unwrap();
    assert_eq!((intensity.count, &intensity.values[..]), (2, &[0.0, 0.5, 1.0, 1.5][..]));
}

#[test]
fn a_bad_file_is_an_error_naming_file_and_line() {
    let points = "1 2 3\n4 5 6\n";
    let good = format!("{HEADER}{points}");
    assert_eq!(decode(&good).unwrap().cloud.len(), 2);
    for (from, to, said) in [
        ("DATA ascii", "", "line 12: \"1\" is no entry"),
        ("DATA ascii\n1 2 3\n4 5 6\n", "", "no PCD file"),
        ("DATA ascii", "DATA zip", "line 11: DATA \"zip\""),
        ("FIELDS x y z", "FIELDS x y w", "without the fields x, y and z"),
        ("FIELDS x y z", "FIELDS x y x", "two fields"),
        ("FIELDS x y z", "FIELDS x y", "2 FIELDS"),
        ("SIZE 4 4 4", "SIZE 4 4 3", "size \"3\""),
        ("TYPE F F F", "TYPE F F X", "type \"X\""),
        ("COUNT 1 1 1", "COUNT 1 1 0", "no values"),
        ("COUNT 1 1 1", "COUNT 1 1 -1", "line 6"),
        ("WIDTH 2", "WIDTH 3", "POINTS 2 is not WIDTH 3 times HEIGHT 1"),
        ("WIDTH 2", "WIDTH two", "line 7"),
        ("HEIGHT 1", "HEIGHT 18446744073709551615", "addressed"),
        ("VIEWPOINT 0 0 0 1 0 0 0", "VIEWPOINT 0 0 0 0 0 0 0", "line 9"),
        ("VIEWPOINT 0 0 0 1 0 0 0", "VIEWPOINT 0 0 0", "line 9"),
        ("POINTS 2", "POINTS 2 2", "line 10"),
        ("VERSION .7", "FOO 7", "line 2: \"FOO\""),
        ("4 5 6", "4 5", "line 13: no value for the field \"z\""),
        ("4 5 6", "4 5 6 7", "line 13: \"7\" is beyond"),
        ("4 5 6", "4 5 six", "line 13: \"six\" is no value of the field \"z\""),
        ("4 5 6\n", "", "2 points are announced, but only 1 follow"),
    ] {
        let message = decode(good.replace(from, to)).expect_err(to).to_string();
        assert!(
            message.starts_with("test.pcd") && message.contains(said),
            "{message:?} does not say {said:?}"
        );
    }
    assert!(decode("").is_err());
    assert!(decode(b"\xff\xfe").is_err());
    assert!(matches!(read_pcd("no/such/file.pcd"), Err(Error::Io { .. })));
}

/// A header claims what no memory holds; the answer must come at once, and be an error.
#[test]
fn absurd_counts_take_neither_memory_nor_time() {
    for data in ["ascii", "binary", "binary_compressed"] {
        for (from, to) in [
            ("WIDTH 2\nHEIGHT 1", "WIDTH 4000000000\nHEIGHT 4000000000"),
            ("WIDTH 2\nHEIGHT 1", "WIDTH 18446744073709551615\nHEIGHT 1"),
            ("COUNT 1 1 1", "COUNT 1 1 18446744073709551615"),
            ("COUNT 1 1 1", "COUNT 1 1 4611686018427387903"),
        ] {
            let header = HEADER.replace("POINTS 2\n", "").replace("ascii", data).replace(from, to);
            for body in [&b""[..], b"1 2 3\n", b"\xff\xff\xff\xff\xff\xff\xff\xff\x00a\xff\xff\xff"] {
                assert!(decode([header.as_bytes(), body].concat()).is_err(), "{header}");
            }
        }
    }
    // 4 GiB announced by the stream itself.
    let header = HEADER.replace("ascii", "binary_compressed").replace("2\n", "357913941\n");
    let bomb =
        [header.as_bytes(), b"\x09\x00\x00\x00\xfc\xff\xff\xff\x00a\xe0\xff\x00\xe0\xff\x00\x00"].concat();
    assert!(decode(bomb).unwrap_err().to_string().contains("test.pcd"));
}

/// The values of each scalar type, the negative ones and the greatest.
#[test]
fn reads_fields_of_every_type() {
    let header = "FIELDS x y z a b c d e f\nSIZE 4 4 4 1 1 2 4 8 8\nTYPE F F F I U I U I F\nPOINTS 1\nDATA ";
    let values = [-3.0, 255.0, -30_000.0, 4_294_967_295.0, -9e9, 0.1];
    let mut bytes = format!("{header}binary\n").into_bytes();
    bytes.extend([0; 12]);
    bytes.extend((-3_i8).to_le_bytes());
    bytes.push(255);
    bytes.extend((-30_000_i16).to_le_bytes());
    bytes.extend(u32::MAX.to_le_bytes());
    bytes.extend((-9_000_000_000_i64).to_le_bytes());
    bytes.extend(0.1_f64.to_le_bytes());
    let text = format!("{header}ascii\n0 0 0 -3 255 -30000 4294967295 -9000000000 0.1\n");
    for cloud in [decode(bytes).unwrap(), decode(&text).unwrap()] {
        assert_eq!(cloud.fields.iter().map(|field| field.values[0]).collect::<Vec<f64>>(), values);
    }
    assert!(decode(text.replace("-3 ", "-3.5 ")).is_err(), "no whole number");
}

fn any_cloud() -> impl Strategy<Value = PointCloud> {
    let point = prop::array::uniform3(prop_oneof![9 => any::<f32>(), 1 => Just(f32::NAN)]);
    (prop::collection::vec((point, any::<[u8; 3]>()), 0..40), any::<bool>()).prop_map(|(both, colored)| {
        let (points, colors): (Vec<_>, Vec<_>) = both.into_iter().unzip();
        if colored { PointCloud::with_colors(points, colors).unwrap() } else { PointCloud::new(points) }
    })
}

proptest! {
    #[test]
    fn reads_what_it_wrote(cloud in any_cloud()) {
        let mut bytes = Vec::new();
        encode_pcd(&mut bytes, &cloud).unwrap();
        let read = decode(&bytes).unwrap();
        // Debug writes as many digits as tell the values apart, and NaN as NaN.
        prop_assert_eq!(format!("{:?}", read.cloud), format!("{cloud:?}"));
        prop_assert_eq!((read.width, read.height, read.fields.len()), (cloud.len(), 1, 0));
    }

    #[test]
    fn no_file_makes_it_panic(
        garbage in prop::collection::vec(any::<u8>(), 0..60),
        at in 0..600_usize,
        name in prop::sample::select(OPEN3D.to_vec()),
    ) {
        let mut bytes = fs::read(path(name)).unwrap();
        let end = (at + garbage.len()).min(bytes.len());
        bytes.splice(at.min(end)..end, garbage.iter().copied());
        let _ = decode(&bytes);
        let _ = decode(&garbage);
    }
}

#[test]
fn every_truncation_is_an_error() {
    for name in OPEN3D {
        let bytes = fs::read(path(name)).unwrap();
        // Where only the last line's end or digits of its last number are missing, there is nothing to
        // notice.
        let is_ascii = name.contains("ascii");
        let noticed =
            if is_ascii { bytes.iter().rposition(|&b| b == b' ').unwrap_or(0) } else { bytes.len() };
        for length in 0..noticed {
            assert!(decode(&bytes[..length]).is_err(), "{name}: {length} of {} bytes", bytes.len());
        }
    }
}
