//! TUM datasets: a whole one, and one spoilt in every way that users' datasets are.

use std::fs;

use crate::common::{Dataset, FRAMES, HEIGHT, WIDTH, colors, depth, time};
use dymlm_io::{Error, FrameBuffers, TumDataset, TumOptions, UncoveredTime};

fn open(dataset: &Dataset) -> Result<TumDataset, Error> {
    TumDataset::open(dataset.folder.path(), &TumOptions::default())
}

#[track_caller]
fn assert_names(error: &Error, pieces: &[&str]) {
    let message = error.to_string();
    for piece in pieces {
        assert!(message.contains(piece), "{message:?} does not name {piece:?}");
    }
}

#[test]
fn loads_a_whole_dataset() {
    let dataset = Dataset::new();
    let tum = open(&dataset).unwrap();
    assert_eq!(tum.frames().len(), FRAMES);
    assert!(tum.faults().is_empty() && tum.gaps().is_empty() && tum.unpaired_depth_images() == 0);
    let mut buffers = FrameBuffers::default();
    for i in 0..FRAMES {
        let posed = tum.load(i).unwrap();
        assert_eq!(posed.frame.timestamp(), tum.frames()[i].timestamp);
        assert_eq!(tum.frames()[i].color_timestamp, Some((time(i) * 1e6 + 4000.0).round() / 1e6));
        assert_eq!(posed.frame.depth(), &depth(i));
        assert_eq!(posed.frame.color().unwrap().data(), colors(i));
        assert_eq!(posed.world_from_camera.translation(), [i as f64, 0.0, 0.0]);
        // The same with reused buffers, whatever they held.
        let again = tum.load_into(i, &mut buffers).unwrap();
        assert_eq!(again, posed);
        buffers.recycle(again.frame);
    }
    assert!(matches!(tum.load(FRAMES), Err(Error::NoFrame { index: 4, count: 4 })));
}

#[test]
fn whoever_wants_the_images_alone_needs_no_trajectory() {
    let dataset = Dataset::new();
    fs::remove_file(dataset.path("groundtruth.txt")).unwrap();
    assert_names(&open(&dataset).unwrap_err(), &["groundtruth.txt"]);
    let mut options = TumOptions::default();
    options.without_poses = true;
    let tum = TumDataset::open(dataset.folder.path(), &options).unwrap();
    assert!(tum.frames().len() == FRAMES && tum.warnings().is_empty());
    assert!(tum.frames().iter().all(|frame| frame.color.is_some()));
    assert!(matches!(tum.load(0), Err(Error::Uncovered { fault: UncoveredTime::Empty { .. }, .. })));
}

#[test]
fn takes_every_nth_frame() {
    let dataset = Dataset::new();
    let mut options = TumOptions::default();
    options.every = 3;
    let tum = TumDataset::open(dataset.folder.path(), &options).unwrap();
    let times: Vec<f64> = tum.frames().iter().map(|frame| frame.timestamp).collect();
    assert_eq!(times, [100.0, 100.3]);
}

#[test]
fn refuses_options_out_of_range() {
    let dataset = Dataset::new();
    let with = |change: fn(&mut TumOptions)| {
        let mut options = TumOptions::default();
        change(&mut options);
        TumDataset::open(dataset.folder.path(), &options)
    };
    assert!(matches!(with(|o| o.every = 0), Err(Error::Config(e)) if e.field == "tum.every"));
    assert!(matches!(with(|o| o.max_association_gap = f64::NAN), Err(Error::Config(_))));
    assert!(matches!(with(|o| o.max_interpolation_gap = -1.0), Err(Error::Config(_))));
}

#[test]
fn reads_associations_in_both_column_orders() {
    for depth_first in [false, true] {
        // With names that say nothing, the lists must tell the columns apart.
        for telling in [true, false] {
            let dataset = Dataset::new();
            let mut lines = String::new();
            for i in 0..FRAMES {
                let (mut color, mut depth) = (format!("rgb/{i}.png"), format!("depth/{i}.png"));
                if !telling {
                    fs::rename(dataset.path(&color), dataset.path(&format!("a{i}.png"))).unwrap();
                    fs::rename(dataset.path(&depth), dataset.path(&format!("b{i}.png"))).unwrap();
                    (color, depth) = (format!("a{i}.png"), format!("b{i}.png"));
                }
                let (color, depth) =
                    (format!("{:.6} {color}", time(i) + 0.004), format!("{:.6} {depth}", time(i)));
                let line = if depth_first { [depth, color] } else { [color, depth] };
                lines += &line.join("\t");
                lines += "\r\n";
            }
            dataset.write("associations.txt", &lines);
            if telling {
                fs::remove_file(dataset.path("rgb.txt")).unwrap();
                fs::remove_file(dataset.path("depth.txt")).unwrap();
            } else {
                dataset.write("rgb.txt", &dataset.read("rgb.txt").replace("rgb/", "a"));
                dataset.write("depth.txt", &dataset.read("depth.txt").replace("depth/", "b"));
            }
            let tum = open(&dataset).unwrap();
            assert_eq!(tum.frames().len(), FRAMES);
            for i in 0..FRAMES {
                let posed = tum.load(i).unwrap();
                assert_eq!(posed.frame.depth(), &depth(i));
                assert_eq!(posed.frame.color().unwrap().data(), colors(i));
                assert!((posed.frame.timestamp() - time(i)).abs() < 1e-9, "the time is the depth image's");
            }
        }
    }
}

#[test]
fn a_missing_list_of_colours_gives_frames_without_colour() {
    let dataset = Dataset::new();
    fs::remove_file(dataset.path("rgb.txt")).unwrap();
    let posed = open(&dataset).unwrap().load(1).unwrap();
    assert!(posed.frame.color().is_none());
    assert_eq!(posed.frame.depth(), &depth(1));
}

#[test]
fn depth_images_without_a_colour_image_are_counted() {
    let dataset = Dataset::new();
    let list = dataset.read("rgb.txt").replace("100.104000", "100.125000");
    dataset.write("rgb.txt", &list);
    let tum = open(&dataset).unwrap();
    assert_eq!((tum.frames().len(), tum.unpaired_depth_images()), (FRAMES - 1, 1));
    dataset.write("rgb.txt", "5.0 rgb/0.png\n");
    assert_names(&open(&dataset).unwrap_err(), &["depth.txt", "none of 4 depth images", "0.02 s"]);
}

#[test]
fn opening_fails_for_what_spoils_the_whole_dataset() {
    for missing in ["camera.json", "depth.txt", "groundtruth.txt"] {
        let dataset = Dataset::new();
        fs::remove_file(dataset.path(missing)).unwrap();
        let error = open(&dataset).unwrap_err();
        assert!(matches!(error, Error::Io { .. }));
        assert_names(&error, &[missing]);
    }
    let dataset = Dataset::new();
    dataset.write("camera.json", "{\"width\": 16,\n \"height\": }");
    assert_names(&open(&dataset).unwrap_err(), &["camera.json, line 2"]);
    for (from, to, said) in [
        ("\"depth_scale\": 5000.0", "\"depth_scale\": 0", "depth scale of 0"),
        ("\"depth_scale\"", "\"scale\"", "`depth_scale`"),
        ("\"fx\": 20.0", "\"fx\": 0", "fx = 0"),
        ("\"fx\"", "\"f\"", "`fx`"),
        ("16", "0", "an image of 0x"),
        // Tables of that size would take gigabytes, and no image of it would be read.
        ("16", "4194304", "larger than"),
    ] {
        let dataset = Dataset::new();
        dataset.write("camera.json", &dataset.read("camera.json").replace(from, to));
        assert_names(&open(&dataset).unwrap_err(), &["camera.json", said]);
    }
    for (file, content, said) in [
        ("groundtruth.txt", "# nothing\n", "no pose"),
        ("groundtruth.txt", "\n1 2 3\n", "groundtruth.txt, line 2"),
        ("depth.txt", "# nothing\n", "no frame"),
        ("depth.txt", "# nothing\nx depth/0.png\n", "depth.txt, line 2"),
    ] {
        let dataset = Dataset::new();
        dataset.write(file, content);
        assert_names(&open(&dataset).unwrap_err(), &[file, said]);
    }
}

#[test]
fn a_bad_line_costs_its_frame_and_is_told() {
    for (list, line) in [("rgb.txt", 3), ("depth.txt", 3), ("groundtruth.txt", 2)] {
        let dataset = Dataset::new();
        let spoilt: Vec<String> = dataset
            .read(list)
            .lines()
            .enumerate()
            .map(
                |(i, content)| {
                    if i + 1 == line { content.replacen("100.", "1oo.", 1) } else { content.to_owned() }
                },
            )
            .collect();
        dataset.write(list, &spoilt.join("\n"));
        let tum = open(&dataset).unwrap();
        assert_eq!(tum.faults().len(), 1, "{list}");
        assert_names(&tum.faults()[0], &[list, &format!("line {line}"), "1oo."]);
        let loaded = (0..tum.frames().len()).filter(|&i| tum.load(i).is_ok()).count();
        // A missing pose is interpolated; a missing image cannot be replaced.
        assert_eq!(loaded, if list == "groundtruth.txt" { FRAMES } else { FRAMES - 1 }, "{list}");
    }
    let dataset = Dataset::new();
    dataset.write("associations.txt", "100 rgb/0.png 100 depth/0.png\n100.1 rgb/1.png 100.1\n");
    let tum = open(&dataset).unwrap();
    assert_eq!(tum.frames().len(), 1);
    assert_names(&tum.faults()[0], &["associations.txt, line 2", "3 columns"]);
}

#[test]
fn a_broken_image_is_an_error_naming_image_list_and_line() {
    type Spoil = fn(&Dataset);
    let whole_size = |dataset: &Dataset, name: &str| fs::metadata(dataset.path(name)).unwrap().len() as usize;
    let cases: [(&str, Spoil, &[&str]); 9] = [
        (
            "missing depth",
            |d| fs::remove_file(d.path("depth/1.png")).unwrap(),
            &["depth.txt, line 3", "depth/1.png"],
        ),
        (
            "missing colour",
            |d| fs::remove_file(d.path("rgb/1.png")).unwrap(),
            &["rgb.txt, line 3", "rgb/1.png"],
        ),
        ("truncated depth", |d| d.truncate("depth/1.png", 100), &["depth.txt, line 3", "depth/1.png"]),
        ("truncated colour", |d| d.truncate("rgb/1.png", 100), &["rgb.txt, line 3", "rgb/1.png"]),
        ("empty depth", |d| d.truncate("depth/1.png", 0), &["depth.txt, line 3", "depth/1.png"]),
        (
            "depth of another size",
            |d| {
                let image = dymlm_core::DepthImage::new(8, 12, vec![1.0; 96]).unwrap();
                dymlm_io::write_depth_png(d.path("depth/1.png"), &image, 5000.0).unwrap();
            },
            &["depth.txt, line 3", "depth/1.png", "8x12", "16x12"],
        ),
        (
            "colour of another size",
            |d| dymlm_io::write_png(d.path("rgb/1.png"), 16, 11, &vec![[0; 3]; 16 * 11]).unwrap(),
            &["rgb.txt, line 3", "rgb/1.png", "16x11", "16x12"],
        ),
        (
            "8-bit depth",
            |d| image::GrayImage::new(16, 12).save(d.path("depth/1.png")).unwrap(),
            &["depth.txt, line 3", "depth/1.png", "L8", "16-bit greyscale"],
        ),
        (
            "coloured depth",
            |d| dymlm_io::write_png(d.path("depth/1.png"), 16, 12, &vec![[0; 3]; 192]).unwrap(),
            &["depth.txt, line 3", "depth/1.png", "Rgb8", "16-bit greyscale"],
        ),
    ];
    let dataset = Dataset::new();
    assert!(whole_size(&dataset, "depth/1.png") > 100 && whole_size(&dataset, "rgb/1.png") > 100);
    let mut buffers = FrameBuffers::default();
    for (name, spoil, pieces) in cases {
        let dataset = Dataset::new();
        spoil(&dataset);
        let tum = open(&dataset).unwrap();
        let error = tum.load_into(1, &mut buffers).expect_err(name);
        assert!(matches!(error, Error::Listed { .. }), "{name}: {error:?}");
        assert_names(&error, pieces);
        // The other frames load as before, also with reused buffers.
        for i in [0, 2, 3] {
            let posed = tum.load_into(i, &mut buffers).unwrap();
            assert_eq!(posed.frame.depth(), &depth(i));
            assert_eq!(posed.frame.color().unwrap().data(), colors(i));
            buffers.recycle(posed.frame);
        }
    }
}

#[test]
fn a_truncated_jpeg_is_an_error() {
    let dataset = Dataset::new();
    let bytes: Vec<u8> = colors(1).into_iter().flatten().collect();
    let picture = image::RgbImage::from_raw(WIDTH as u32, HEIGHT as u32, bytes).unwrap();
    picture.save(dataset.path("rgb/1.jpg")).unwrap();
    dataset.write("rgb.txt", &dataset.read("rgb.txt").replace("rgb/1.png", "rgb/1.jpg"));
    let tum = open(&dataset).unwrap();
    let whole = fs::read(dataset.path("rgb/1.jpg")).unwrap();
    let posed = tum.load(1).unwrap();
    for (found, [r, _, b]) in posed.frame.color().unwrap().data().iter().zip(colors(1)) {
        assert!(found[0].abs_diff(r) < 30 && found[2].abs_diff(b) < 30, "JPEG is lossy, but not so much");
    }
    for length in 0..whole.len() {
        fs::write(dataset.path("rgb/1.jpg"), &whole[..length]).unwrap();
        let error = tum.load(1).expect_err("truncated");
        assert_names(&error, &["rgb.txt, line 3", "rgb/1.jpg"]);
    }
}

#[test]
fn every_truncation_of_a_depth_png_is_an_error_or_the_whole_picture() {
    let dataset = Dataset::new();
    let tum = open(&dataset).unwrap();
    let whole = fs::read(dataset.path("depth/2.png")).unwrap();
    let mut refused = 0;
    for length in 0..whole.len() {
        fs::write(dataset.path("depth/2.png"), &whole[..length]).unwrap();
        match tum.load(2) {
            Ok(posed) => assert_eq!(posed.frame.depth(), &depth(2)),
            Err(error) => {
                assert_names(&error, &["depth.txt, line 4", "depth/2.png"]);
                refused += 1;
            }
        }
    }
    // Only the end marker and the last checksum may be missing without an error.
    assert!(refused >= whole.len() - 24, "{refused} of {}", whole.len());
}

#[test]
fn a_frame_that_the_trajectory_does_not_cover_is_an_error_naming_its_line() {
    let dataset = Dataset::new();
    dataset.write(
        "given.txt",
        "# begins late, has a gap\n100.05 0 0 0 0 0 0 1\n\n100.16 1 0 0 0 0 0 1\n101 2 0 0 0 0 0 1\n",
    );
    let mut options = TumOptions::default();
    options.trajectory = Some(dataset.path("given.txt"));
    let tum = TumDataset::open(dataset.folder.path(), &options).unwrap();

    let before = tum.load(0).unwrap_err();
    assert!(matches!(before, Error::Uncovered { fault: UncoveredTime::Before { .. }, .. }));
    assert_names(&before, &["given.txt, line 2", "100 s", "begins at 100.05 s"]);

    let x = tum.load(1).unwrap().world_from_camera.translation()[0];
    assert!((x - 0.05 / 0.11).abs() < 1e-9, "{x}");

    let within = tum.load(2).unwrap_err();
    assert!(matches!(within, Error::Uncovered { fault: UncoveredTime::Gap { .. }, .. }));
    assert_names(&within, &["given.txt, line 4", "100.2 s", "from 100.16 s to 101 s", "0.2 s"]);
    assert_eq!(tum.gaps().len(), 1);
    assert_eq!((tum.gaps()[0].from, tum.gaps()[0].to), (100.16, 101.0));

    dataset.write("given.txt", "100.0 0 0 0 0 0 0 1\n100.1 0 0 0 0 0 0 1\n");
    let tum = TumDataset::open(dataset.folder.path(), &options).unwrap();
    let after = tum.load(3).unwrap_err();
    assert!(matches!(after, Error::Uncovered { fault: UncoveredTime::After { .. }, .. }));
    assert_names(&after, &["given.txt, line 2", "100.3 s", "ends at 100.1 s"]);
}

#[test]
fn frames_are_in_time_order_whatever_the_lists_order() {
    let dataset = Dataset::new();
    for list in ["rgb.txt", "depth.txt", "groundtruth.txt"] {
        let text = dataset.read(list);
        let lines: Vec<&str> = text.lines().rev().collect();
        dataset.write(list, &lines.join("\n"));
    }
    let tum = open(&dataset).unwrap();
    for i in 0..FRAMES {
        let posed = tum.load(i).unwrap();
        assert_eq!(posed.frame.depth(), &depth(i));
        assert_eq!(posed.world_from_camera.translation()[0], i as f64);
    }
}
