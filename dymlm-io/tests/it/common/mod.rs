//! A small dataset on disk, whole, for tests to spoil.

use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use dymlm_core::{DepthImage, Rgb};
use tempfile::TempDir;

pub(crate) const WIDTH: usize = 16;
pub(crate) const HEIGHT: usize = 12;
pub(crate) const FRAMES: usize = 4;
pub(crate) const DEPTH_SCALE: f64 = 5000.0;

/// Time of frame `i`: 10 Hz from 100 s.
pub(crate) fn time(i: usize) -> f64 {
    100.0 + 0.1 * i as f64
}

pub(crate) fn depth(i: usize) -> DepthImage {
    let data = (0..WIDTH * HEIGHT).map(|p| (1000 + 100 * i + p) as f32 * (1.0 / DEPTH_SCALE) as f32);
    DepthImage::new(WIDTH, HEIGHT, data.collect()).unwrap()
}

pub(crate) fn colors(i: usize) -> Vec<Rgb> {
    (0..WIDTH * HEIGHT).map(|p| [p as u8, i as u8, 200]).collect()
}

pub(crate) struct Dataset {
    pub(crate) folder: TempDir,
}

impl Dataset {
    /// Images, both lists, no associations, a pose for each frame at x = i metres.
    pub(crate) fn new() -> Self {
        let dataset = Self { folder: tempfile::tempdir().unwrap() };
        let (mut rgb, mut depth_list, mut poses) =
            ("# rgb\n".to_owned(), "# depth\n".to_owned(), String::new());
        for sub in ["rgb", "depth"] {
            fs::create_dir(dataset.path(sub)).unwrap();
        }
        for i in 0..FRAMES {
            dymlm_io::write_png(dataset.path(&format!("rgb/{i}.png")), WIDTH, HEIGHT, &colors(i)).unwrap();
            dymlm_io::write_depth_png(dataset.path(&format!("depth/{i}.png")), &depth(i), DEPTH_SCALE)
                .unwrap();
            writeln!(rgb, "{:.6} rgb/{i}.png", time(i) + 0.004).unwrap();
            writeln!(depth_list, "{:.6} depth/{i}.png", time(i)).unwrap();
            writeln!(poses, "{:.6} {i} 0 0 0 0 0 1", time(i)).unwrap();
        }
        dataset.write("rgb.txt", &rgb);
        dataset.write("depth.txt", &depth_list);
        dataset.write("groundtruth.txt", &poses);
        dataset.write(
            "camera.json",
            r#"{"width": 16, "height": 12, "fx": 20.0, "fy": 20.0, "cx": 7.5, "cy": 5.5, "depth_scale": 5000.0}"#,
        );
        dataset
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, content: &str) {
        fs::write(self.path(name), content).unwrap();
    }

    pub(crate) fn read(&self, name: &str) -> String {
        fs::read_to_string(self.path(name)).unwrap()
    }

    /// Writes only the first `bytes` of a file back.
    pub(crate) fn truncate(&self, name: &str, bytes: usize) {
        let content = fs::read(self.path(name)).unwrap();
        fs::write(self.path(name), &content[..bytes]).unwrap();
    }
}

/// Names in a folder, sorted.
pub(crate) fn names_in(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}
