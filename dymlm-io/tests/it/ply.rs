//! PLY: files by `Open3D`, round trips, bad files.
use std::fs;

use dymlm_core::PointCloud;
use dymlm_io::{Error, decode_ply, encode_ply, read_ply};
use proptest::prelude::*;

/// The cloud of `data/make_clouds.py`.
fn open3d_cloud() -> PointCloud {
    let i = || (0..12).map(f64::from);
    let points = i().map(|i| [0.25 * i - 1.0, 0.1 * i * i, 2.0 - i / 3.0].map(|x| x as f32)).collect();
    let colors = (0..12).map(|i| [20 * i, 255 - 20 * i, 7 * i + 1]).collect();
    PointCloud::with_colors(points, colors).unwrap()
}

#[track_caller]
fn assert_close(found: &PointCloud, expected: &PointCloud) {
    assert_eq!(found.colors(), expected.colors());
    assert_eq!(found.len(), expected.len());
    for (a, b) in found.points().iter().zip(expected.points()) {
        for axis in 0..3 {
            assert!((a[axis] - b[axis]).abs() < 1e-5, "{a:?} {b:?}");
        }
    }
}

#[test]
fn reads_what_open3d_wrote() {
    for name in ["open3d_ascii.ply", "open3d_binary.ply"] {
        let path = format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"));
        assert_close(&read_ply(path).unwrap(), &open3d_cloud());
    }
}

fn decode(bytes: &[u8]) -> Result<PointCloud, Error> {
    decode_ply(bytes, "test.ply")
}

#[test]
fn writes_the_format_that_is_documented() {
    let cloud = PointCloud::with_colors(vec![[1.0, -2.0, 0.5]], vec![[1, 2, 3]]).unwrap();
    let mut bytes = Vec::new();
    encode_ply(&mut bytes, &cloud).unwrap();
    let mut expected =
        b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty float x\nproperty float y\n\
        property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n"
            .to_vec();
    for value in [1.0_f32, -2.0, 0.5] {
        expected.extend(value.to_le_bytes());
    }
    expected.extend([1, 2, 3]);
    assert_eq!(String::from_utf8_lossy(&bytes), String::from_utf8_lossy(&expected));
    assert_eq!(bytes, expected);
}

#[test]
fn reads_big_endian_other_types_and_passes_over_the_rest() {
    let mut bytes = b"ply\r\nformat binary_big_endian 1.0\r\ncomment x\r\nobj_info y\r\nelement camera 2\r\n\
        property uchar id\r\nproperty list uchar int views\r\nelement vertex 2\r\nproperty float nx\r\nproperty double x\r\n\
        property short y\r\nproperty float z\r\nproperty list uchar float weights\r\nproperty uchar diffuse_red\r\n\
        property uchar diffuse_green\r\nproperty uchar diffuse_blue\r\nproperty uchar alpha\r\nelement face 1000000\r\n\
        property list uchar int vertex_indices\r\nend_header\r\n"
        .to_vec();
    bytes.extend([7, 1, 0, 0, 0, 9, 8, 0]);
    for (x, y, z, weights) in [(1.5_f64, -2_i16, 3.5_f32, 2_u8), (-0.25, 300, 0.0, 0)] {
        bytes.extend(9.0_f32.to_be_bytes());
        bytes.extend(x.to_be_bytes());
        bytes.extend(y.to_be_bytes());
        bytes.extend(z.to_be_bytes());
        bytes.push(weights);
        (0..weights).for_each(|_| bytes.extend(1.0_f32.to_be_bytes()));
        bytes.extend([10, 20, 30, 255]);
    }
    let expected =
        PointCloud::with_colors(vec![[1.5, -2.0, 3.5], [-0.25, 300.0, 0.0]], vec![[10, 20, 30]; 2]).unwrap();
    assert_eq!(decode(&bytes).unwrap(), expected);
}

/// Rows of one size are read another way than rows with lists; all scalar types, more rows than a block, both
/// orders.
#[test]
fn reads_rows_of_one_size_of_every_type() {
    let count = 5000_usize;
    for big_endian in [false, true] {
        let format = if big_endian { "big" } else { "little" };
        for (name, size) in [
            ("char", 1),
            ("uint8", 1),
            ("int16", 2),
            ("ushort", 2),
            ("int", 4),
            ("uint32", 4),
            ("float", 4),
            ("double", 8),
        ] {
            let mut bytes = format!(
                "ply\nformat binary_{format}_endian 1.0\nelement camera 3\nproperty double a\nproperty uchar b\n\
                 element vertex {count}\nproperty uchar blue\nproperty float z\nproperty {name} y\nproperty short w\n\
                 property uchar red\nproperty uchar green\nproperty double x\nend_header\n"
            )
            .into_bytes();
            bytes.extend([0xff; 3 * 9]);
            for i in 0..count {
                let mut push = |mut value: Vec<u8>| {
                    if big_endian {
                        value.reverse();
                    }
                    bytes.extend(value);
                };
                let y = (i % 100) as i64;
                push(vec![3]);
                push((i as f32 + 0.5).to_le_bytes().to_vec());
                match name {
                    "float" => push((y as f32).to_le_bytes().to_vec()),
                    "double" => push((y as f64).to_le_bytes().to_vec()),
                    _ => push(y.to_le_bytes()[..size].to_vec()),
                }
                push(vec![9, 9]);
                push(vec![1]);
                push(vec![(i % 256) as u8]);
                push((-(i as f64)).to_le_bytes().to_vec());
            }
            let cloud = decode(&bytes).unwrap();
            assert_eq!(cloud.len(), count);
            for (i, (point, color)) in cloud.points().iter().zip(cloud.colors().unwrap()).enumerate() {
                assert_eq!(*point, [-(i as f32), (i % 100) as f32, i as f32 + 0.5], "{name} {format}");
                assert_eq!(*color, [1, (i % 256) as u8, 3]);
            }
            let message = decode(&bytes[..bytes.len() - 1]).unwrap_err().to_string();
            assert!(
                message.contains("5000 elements \"vertex\" are announced, but only 4999 follow"),
                "{message}"
            );
        }
    }
}

#[test]
fn reads_ascii_with_numbers_that_are_none() {
    let text = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        end_header\n1 2 3\nnan nan nan\n1e-3 -inf +4.5\n";
    let cloud = decode(text.as_bytes()).unwrap();
    assert_eq!(cloud.points()[0], [1.0, 2.0, 3.0]);
    assert!(cloud.points()[1].iter().all(|x| x.is_nan()));
    assert_eq!(cloud.points()[2], [1e-3, f32::NEG_INFINITY, 4.5]);
    assert!(cloud.colors().is_none());
}

#[test]
fn a_bad_file_is_an_error_naming_file_and_line() {
    let header =
        "ply\nformat ascii 1.0\nelement vertex 2\nproperty float x\nproperty float y\nproperty float z\n";
    for (text, said) in [
        (String::new(), "test.ply"),
        ("plyx\n".into(), "test.ply, line 1"),
        ("ply\nformat ascii 1.0\nelement vertex -3\nend_header\n".into(), "test.ply, line 3"),
        (
            "ply\nformat ascii 1.0\nelement vertex 99999999999999999999999\nend_header\n".into(),
            "test.ply, line 3",
        ),
        ("ply\nformat xml 1.0\nend_header\n".into(), "test.ply, line 2"),
        ("ply\nformat ascii 1.0\nproperty float x\nend_header\n".into(), "test.ply, line 3"),
        ("ply\nelement vertex 0\nend_header\n".into(), "test.ply"),
        ("ply\nformat ascii 1.0\nend_header\n".into(), "without vertices"),
        (header.to_owned(), "test.ply: no PLY file: its header does not end"),
        (format!("{header}end_header\n1 2 3\n"), "2 elements \"vertex\" are announced, but only 1 follow"),
        (format!("{header}end_header\n1 2 3\n1 2 3 4\n"), "test.ply, line 9: \"4\" is beyond"),
        (header.replace("float z", "float y"), "test.ply, line 6: two properties"),
        (format!("{header}end_header\n1 2 3\n1 2\n"), "test.ply, line 9"),
        (format!("{header}end_header\n1 2 3\n1 two 3\n"), "test.ply, line 9"),
        (header.replace("float z", "float w") + "end_header\n1 2 3\n1 2 3\n", "property z"),
        (header.replace("float z", "list uchar float z") + "end_header\n1 2 1 3\n1 2 1 3\n", "property z"),
    ] {
        let message = decode(text.as_bytes()).expect_err(&text).to_string();
        assert!(message.contains(said), "{message:?} does not say {said:?}");
        assert!(!message.contains('\n') && message.len() < 300, "{message:?}");
    }
    let long = format!("{header}end_header\n1 2 {}\n", "9a".repeat(100_000));
    assert!(decode(long.as_bytes()).unwrap_err().to_string().len() < 300);
}

/// A header claims what no memory holds; the answer must come at once, and be an error.
#[test]
fn absurd_counts_take_neither_memory_nor_time() {
    let xyz = "property float x\nproperty float y\nproperty float z\n";
    for body in [
        format!("element vertex 18446744073709551615\n{xyz}end_header\n"),
        format!("element vertex 4000000000000\n{xyz}end_header\n0123456789ab"),
        // Elements without properties take no bytes at all.
        format!("element nothing 18446744073709551615\nelement vertex 1\n{xyz}end_header\n"),
        "element vertex 18446744073709551615\nend_header\n".to_owned(),
        format!(
            "element l 1\nproperty list uint double a\nelement vertex 0\n{xyz}end_header\n\u{7f}\u{7f}\u{7f}\u{7f}0"
        ),
    ] {
        for format in ["ascii", "binary_little_endian", "binary_big_endian"] {
            let text = format!("ply\nformat {format} 1.0\n{body}");
            assert!(decode(text.as_bytes()).is_err(), "{text}");
        }
    }
}

fn any_cloud() -> impl Strategy<Value = PointCloud> {
    prop::collection::vec((prop::array::uniform3(any::<f32>()), any::<[u8; 3]>()), 0..60).prop_flat_map(
        |both| {
            any::<bool>().prop_map(move |colored| {
                let (points, colors): (Vec<_>, Vec<_>) = both.iter().copied().unzip();
                if colored {
                    PointCloud::with_colors(points, colors).unwrap()
                } else {
                    PointCloud::new(points)
                }
            })
        },
    )
}

/// Equal to the bit, NaN included.
fn bits(cloud: &PointCloud) -> (Vec<[u32; 3]>, Option<&[[u8; 3]]>) {
    (cloud.points().iter().map(|point| point.map(f32::to_bits)).collect(), cloud.colors())
}

proptest! {
    #[test]
    fn reads_what_it_wrote(cloud in any_cloud()) {
        let mut bytes = Vec::new();
        encode_ply(&mut bytes, &cloud).unwrap();
        let read = decode(&bytes).unwrap();
        prop_assert_eq!(bits(&read), bits(&cloud));
        // And any part of it is an error.
        for length in 0..bytes.len() {
            prop_assert!(decode(&bytes[..length]).is_err(), "{} of {} bytes", length, bytes.len());
        }
    }

    #[test]
    fn no_file_makes_it_panic(
        garbage in prop::collection::vec(any::<u8>(), 0..100),
        at in 0..400_usize,
        binary in any::<bool>(),
    ) {
        let name = if binary { "open3d_binary.ply" } else { "open3d_ascii.ply" };
        let mut bytes = fs::read(format!("{}/tests/data/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap();
        let end = (at + garbage.len()).min(bytes.len());
        bytes.splice(at.min(end)..end, garbage.iter().copied());
        let _ = decode(&bytes);
        let _ = decode(&garbage);
    }
}
