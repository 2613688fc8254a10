use std::path::Path;

use dymlm_core::{Detection, Frame, Mask, Pose};
use dymlm_io::{DetectionFile, TumDataset, TumOptions};

/// A frame of a recording with people, and their exact masks.
#[derive(Debug, Clone)]
pub struct RecordedFrame {
    /// Depth and colour.
    pub frame: Frame,
    /// Pose of the camera.
    pub world_from_camera: Pose,
    /// The detections; empty without detections.jsonl.
    pub detections: Vec<Detection>,
    /// The number of the person that each pixel shows, row by row; 0 for nobody.
    people: Vec<u8>,
}

impl RecordedFrame {
    /// The mask of all people.
    pub fn people(&self) -> Mask {
        self.mask(|person| person > 0)
    }

    /// The mask of one person.
    pub fn person(&self, number: u8) -> Mask {
        self.mask(|person| person == number)
    }

    fn mask(&self, shows: impl Fn(u8) -> bool) -> Mask {
        let camera = self.frame.camera();
        Mask::new(camera.width(), camera.height(), self.people.iter().map(|&p| shows(p)).collect()).unwrap()
    }
}

/// The frames of a TUM folder, read one by one, with detections.jsonl and the exact masks in masks/, if there
/// are any.
pub fn recorded_frames(folder: &Path) -> impl Iterator<Item = RecordedFrame> + use<> {
    let dataset = TumDataset::open(folder, &TumOptions::default()).unwrap();
    let detections = folder.join("detections.jsonl");
    let detections = detections
        .exists()
        .then(|| DetectionFile::open(detections, DetectionFile::DEFAULT_TOLERANCE).unwrap());
    let masks = folder.join("masks");
    (0..dataset.frames().len()).map(move |index| {
        let posed = dataset.load(index).unwrap();
        let listed = &dataset.frames()[index];
        let found = detections.as_ref().and_then(|file| file.at(posed.frame.timestamp()).unwrap());
        let mask = masks.join(listed.depth.file_name().unwrap());
        let pixels = posed.frame.depth().data().len();
        let people = image::open(mask).map_or_else(|_| vec![0; pixels], |mask| mask.into_luma8().into_raw());
        RecordedFrame {
            frame: posed.frame,
            world_from_camera: posed.world_from_camera,
            detections: found.unwrap_or_default(),
            people,
        }
    })
}
