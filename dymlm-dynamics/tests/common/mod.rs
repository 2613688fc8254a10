//! Reads the recorded kitchen with people.
#![allow(dead_code, reason = "each test uses a part")]

use std::fs;
use std::path::{Path, PathBuf};

use dymlm_core::{BoundingBox, DepthImage, Detection, Frame, Mask, PinholeCamera, Pose};

/// One recorded frame and its truth.
pub(crate) struct Recorded {
    pub(crate) frame: Frame,
    pub(crate) world_from_camera: Pose,
    pub(crate) detections: Vec<Detection>,
    /// `true` = person.
    pub(crate) people: Mask,
    pub(crate) color_file: PathBuf,
}

/// All frames of a sequence, read one by one.
pub(crate) fn kitchen(folder: &Path) -> impl Iterator<Item = Recorded> {
    let lines = |name: &str| {
        let text = fs::read_to_string(folder.join(name)).unwrap();
        text.lines().filter(|line| !line.starts_with('#')).map(String::from).collect::<Vec<_>>()
    };
    let camera: serde_json::Value =
        serde_json::from_str(&fs::read_to_string(folder.join("camera.json")).unwrap()).unwrap();
    let number = |key: &str| camera[key].as_f64().unwrap();
    let (width, height) = (number("width") as usize, number("height") as usize);
    let depth_scale = number("depth_scale");
    let camera =
        PinholeCamera::new(width, height, number("fx"), number("fy"), number("cx"), number("cy")).unwrap();
    let poses = lines("groundtruth.txt");
    let detections = lines("detections.jsonl");
    let folder = folder.to_path_buf();

    lines("associations.txt").into_iter().zip(poses).zip(detections).map(
        move |((files, pose), detections)| {
            let files: Vec<&str> = files.split_whitespace().collect();
            let [timestamp, tx, ty, tz, qx, qy, qz, qw] =
                pose.split_whitespace().map(|v| v.parse().unwrap()).collect::<Vec<f64>>().try_into().unwrap();
            let depth = image::open(folder.join(files[3])).unwrap().into_luma16();
            let depth = DepthImage::from_u16(width, height, depth.as_raw(), depth_scale).unwrap();
            let mask = folder.join("masks").join(Path::new(files[3]).file_name().unwrap());
            let people = image::open(mask).map_or_else(
                |_| Mask::filled(width, height, false).unwrap(),
                |mask| {
                    let mask = mask.into_luma8();
                    Mask::new(width, height, mask.as_raw().iter().map(|&id| id != 0).collect()).unwrap()
                },
            );
            Recorded {
                frame: Frame::new(timestamp, camera, depth, None).unwrap(),
                world_from_camera: Pose::new([tx, ty, tz], [qx, qy, qz, qw]).unwrap(),
                detections: read_detections(&detections),
                people,
                color_file: folder.join(files[1]),
            }
        },
    )
}

fn read_detections(line: &str) -> Vec<Detection> {
    let line: serde_json::Value = serde_json::from_str(line).unwrap();
    let detections = line["detections"].as_array().unwrap().iter();
    detections
        .map(|detection| {
            let side = |i: usize| detection["bbox"][i].as_f64().unwrap() as f32;
            let bounding_box = BoundingBox::new(side(0), side(1), side(2), side(3)).unwrap();
            let label = detection["label"].as_str().unwrap();
            Detection::new(label, detection["score"].as_f64().unwrap() as f32, bounding_box).unwrap()
        })
        .collect()
}

/// How a mask compares with the truth, over the pixels that have a depth.
#[derive(Debug, Default, Clone, Copy)]
pub(crate) struct Coverage {
    pub(crate) people: usize,
    pub(crate) masked: usize,
    pub(crate) both: usize,
}

impl Coverage {
    pub(crate) fn add(&mut self, depth: &DepthImage, people: &Mask, is_static: &Mask) {
        for ((&z, person), is_static) in depth.data().iter().zip(people.pixels()).zip(is_static.pixels()) {
            if z > 0.0 {
                self.people += usize::from(person);
                self.masked += usize::from(!is_static);
                self.both += usize::from(person && !is_static);
            }
        }
    }

    /// Share of the people that is masked.
    pub(crate) fn recall(&self) -> f64 {
        self.both as f64 / self.people as f64
    }

    /// Share of the masked that is people.
    pub(crate) fn precision(&self) -> f64 {
        self.both as f64 / self.masked as f64
    }
}
