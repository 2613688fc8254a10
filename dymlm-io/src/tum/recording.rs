use std::path::Path;

use dymlm_core::{Detection, Frame, Pose};

use super::{FrameBuffers, TumDataset, TumOptions};
use crate::{DetectionFile, Error, YoloFolder, read_class_names};

/// A TUM RGB-D dataset with detections in its frames.
#[derive(Debug)]
pub struct TumRecording {
    dataset: TumDataset,
    detections: RecordedDetections,
}

#[derive(Debug)]
enum RecordedDetections {
    None,
    /// The caller does not want them.
    LeftAlone,
    File {
        file: DetectionFile,
        /// The line of each frame.
        lines: Vec<Option<usize>>,
    },
    Yolo(YoloFolder),
}

/// One loaded frame of a recording, with its detections and camera pose.
#[derive(Debug)]
#[non_exhaustive]
pub struct RecordedFrame {
    /// The frame.
    pub frame: Frame,
    /// Detections of all labels; `None` when no detector ran on the frame.
    pub detections: Option<Vec<Detection>>,
    /// Takes camera coordinates to the world.
    pub world_from_camera: Pose,
}

impl TumRecording {
    /// Opens a dataset with its detections, each line of them for the frame nearest in time: a JSON-lines file or
    /// a YOLO folder (with class names in its `names.txt`). If `detections` is `None`, the dataset's own
    /// `detections.jsonl` is used, if there is one.
    ///
    /// # Errors
    ///
    /// As [`TumDataset::open`], and when the detections cannot be read.
    pub fn open(
        folder: impl AsRef<Path>,
        detections: Option<&Path>,
        options: &TumOptions,
    ) -> Result<Self, Error> {
        let dataset = TumDataset::open(folder.as_ref(), options)?;
        let own = folder.as_ref().join("detections.jsonl");
        let detections = match detections.or_else(|| own.exists().then_some(&*own)) {
            None => RecordedDetections::None,
            Some(path) => RecordedDetections::open(path, &dataset)?,
        };
        Ok(Self { dataset, detections })
    }

    /// Opens a dataset and ignores its detections, if it has any: for callers that run a detector on its
    /// frames.
    ///
    /// # Errors
    ///
    /// As [`TumDataset::open`].
    pub fn without_detections(folder: impl AsRef<Path>, options: &TumOptions) -> Result<Self, Error> {
        let dataset = TumDataset::open(folder, options)?;
        Ok(Self { dataset, detections: RecordedDetections::LeftAlone })
    }

    /// The dataset.
    pub fn dataset(&self) -> &TumDataset {
        &self.dataset
    }

    /// One warning for each fault of lists and detections that does not prevent all frames from being loaded,
    /// and one when there are no detections.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.dataset.warnings();
        match &self.detections {
            RecordedDetections::None => {
                warnings.push("no detections: only late removal keeps movers out of the map".into());
            }
            RecordedDetections::File { file, .. } => {
                warnings.extend(file.faults().iter().map(ToString::to_string));
            }
            RecordedDetections::LeftAlone | RecordedDetections::Yolo(_) => {}
        }
        warnings
    }

    /// Loads a frame. Boxes of detections are rectified like the colour image.
    ///
    /// # Errors
    ///
    /// As [`TumDataset::load`], and when the frame's detections cannot be read.
    pub fn load(&self, index: usize, buffers: &mut FrameBuffers) -> Result<RecordedFrame, Error> {
        let posed = self.dataset.load_into(index, buffers)?;
        let detections = self.detections_of(index)?;
        let rectified = |found: Vec<Detection>| match self.dataset.rectifier() {
            Some(rectifier) => found.iter().filter_map(|one| rectifier.rectify_detection(one)).collect(),
            None => found,
        };
        Ok(RecordedFrame {
            frame: posed.frame,
            detections: detections.map(rectified),
            world_from_camera: posed.world_from_camera,
        })
    }

    fn detections_of(&self, index: usize) -> Result<Option<Vec<Detection>>, Error> {
        let Some(listed) = self.dataset.frames().get(index) else { return Ok(None) };
        Ok(match &self.detections {
            RecordedDetections::None | RecordedDetections::LeftAlone => None,
            RecordedDetections::File { file, lines } => {
                file.at_line(lines.get(index).copied().flatten(), listed.seen_at())?
            }
            RecordedDetections::Yolo(folder) => {
                Some(folder.read(listed.color.as_ref().unwrap_or(&listed.depth))?)
            }
        })
    }
}

impl RecordedDetections {
    fn open(path: &Path, dataset: &TumDataset) -> Result<Self, Error> {
        if path.is_dir() {
            let camera = dataset.camera();
            let names = read_class_names(path.join("names.txt"))?;
            return Ok(Self::Yolo(YoloFolder::open(path, names, camera.width(), camera.height())?));
        }
        let file = DetectionFile::open(path, DetectionFile::DEFAULT_TOLERANCE)?;
        let lines = dataset.lines_of(&file);
        Ok(Self::File { file, lines })
    }
}
