use std::path::{Path, PathBuf};

use dymlm::core::{Detection, Frame, Pose, Rectifier};
use dymlm_io::{
    FrameBuffers, McapOptions, McapRecording, RecordedFrame, TumOptions, TumRecording, read_color_image,
};
use dymlm_sim::{Sequence, SequenceConfig};

use crate::{AnyError, FrameDetector, PeopleMasks};

/// Where frames come from: a recorded dataset, a bag, or the built-in synthetic sequence.
#[derive(Debug)]
pub enum FrameSource {
    /// A TUM RGB-D folder.
    Recorded(Box<Recording>),
    /// A ROS 2 bag in MCAP.
    Bag(Box<BagRecording>),
    /// People walking through a rendered office.
    Synthetic(Box<Sequence>),
}

/// A dataset with its detections, and with masks where it has them.
#[derive(Debug)]
pub struct Recording {
    folder: PathBuf,
    source: TumRecording,
    buffers: FrameBuffers,
}

/// A bag with the buffers that its frames are loaded through.
#[derive(Debug)]
pub struct BagRecording {
    source: McapRecording,
    buffers: FrameBuffers,
}

/// One frame with its detections and its pose.
#[derive(Debug)]
pub struct SourceFrame {
    /// The frame.
    pub frame: Frame,
    /// Detections of all labels; `None` when the detector did not run on the frame.
    pub detections: Option<Vec<Detection>>,
    /// Camera to world.
    pub world_from_camera: Pose,
}

/// A sequence's config with only every `n`-th frame of the same walk.
pub fn every(mut config: SequenceConfig, n: usize) -> SequenceConfig {
    let n = n.max(1);
    config.frames = config.frames.div_ceil(n);
    config.frame_rate /= n as f64;
    config
}

impl FrameSource {
    /// The built-in sequence.
    ///
    /// # Errors
    ///
    /// When the config is refused.
    pub fn synthetic(config: &SequenceConfig) -> Result<Self, AnyError> {
        Ok(Self::Synthetic(Box::new(Sequence::new(config)?)))
    }

    /// A recorded dataset. `detections` is a JSON-lines file or a YOLO folder (class names in `names.txt`
    /// there); without it, the dataset's own `detections.jsonl` is used, if there is one.
    ///
    /// # Errors
    ///
    /// When the dataset or the detections cannot be opened.
    pub fn recorded(
        folder: &Path,
        detections: Option<&Path>,
        options: &TumOptions,
    ) -> Result<Self, AnyError> {
        let source = TumRecording::open(folder, detections, options)?;
        let buffers = FrameBuffers::default();
        Ok(Self::Recorded(Box::new(Recording { folder: folder.to_path_buf(), source, buffers })))
    }

    /// A recorded dataset whose own detections are not read, since the caller runs a detector.
    ///
    /// # Errors
    ///
    /// When the dataset cannot be opened.
    pub fn without_detections(folder: &Path, options: &TumOptions) -> Result<Self, AnyError> {
        let source = TumRecording::without_detections(folder, options)?;
        let buffers = FrameBuffers::default();
        Ok(Self::Recorded(Box::new(Recording { folder: folder.to_path_buf(), source, buffers })))
    }

    /// A ROS 2 bag in MCAP.
    ///
    /// # Errors
    ///
    /// When the bag cannot be opened.
    pub fn bag(path: &Path, options: &McapOptions) -> Result<Self, AnyError> {
        let source = McapRecording::open(path, options)?;
        Ok(Self::Bag(Box::new(BagRecording { source, buffers: FrameBuffers::default() })))
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        match self {
            Self::Recorded(recording) => recording.source.dataset().frames().len(),
            Self::Bag(bag) => bag.source.frames().len(),
            Self::Synthetic(sequence) => sequence.len(),
        }
    }

    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The pose of a frame that has one, without loading its images.
    pub fn pose(&self, index: usize) -> Option<Pose> {
        match self {
            Self::Recorded(recording) => {
                recording.source.dataset().frames().get(index)?.world_from_camera.ok()
            }
            Self::Bag(bag) => bag.source.frames().get(index)?.world_from_camera.clone().ok(),
            Self::Synthetic(sequence) => (index < sequence.len()).then(|| sequence.world_from_camera(index)),
        }
    }

    /// The time of a frame, seconds, without loading its images.
    pub fn timestamp(&self, index: usize) -> Option<f64> {
        match self {
            Self::Recorded(recording) => Some(recording.source.dataset().frames().get(index)?.timestamp),
            Self::Bag(bag) => Some(bag.source.frames().get(index)?.timestamp),
            Self::Synthetic(sequence) => (index < sequence.len()).then(|| sequence.timestamp(index)),
        }
    }

    /// Problems in the dataset's lists and detections that do not prevent the loading of any listed frame;
    /// worth a warning.
    pub fn faults(&self) -> Vec<String> {
        match self {
            Self::Recorded(recording) => recording.source.warnings(),
            Self::Bag(bag) => bag.source.warnings().to_vec(),
            Self::Synthetic(_) => Vec::new(),
        }
    }

    /// Loads a frame.
    ///
    /// # Errors
    ///
    /// The problem with this frame; other frames can still be loaded.
    pub fn load(&mut self, index: usize) -> Result<SourceFrame, AnyError> {
        match self {
            Self::Recorded(recording) => Ok(recording.source.load(index, &mut recording.buffers)?.into()),
            Self::Bag(bag) => Ok(bag.source.load(index, &mut bag.buffers)?.into()),
            Self::Synthetic(sequence) => {
                let frame = sequence.frame(index).ok_or("no such frame")?;
                Ok(SourceFrame {
                    frame: frame.frame,
                    detections: Some(frame.detections),
                    world_from_camera: frame.world_from_camera,
                })
            }
        }
    }

    /// A detector's results in a loaded frame, in the frame's pixels; `None` when the frame has no colour
    /// image.
    ///
    /// If the lens of a folder's camera has distortion, the detector runs on the stored image, as detectors
    /// that write files do: a file written by the same detector gives the same results.
    ///
    /// # Errors
    ///
    /// When the stored image cannot be read, or the detector fails on it.
    pub fn detect(
        &self,
        index: usize,
        frame: &Frame,
        detector: &mut dyn FrameDetector,
    ) -> Result<Option<Vec<Detection>>, AnyError> {
        let Some(color) = frame.color() else { return Ok(None) };
        let Some((stored, rectifier)) = self.stored_color(index) else {
            return detector.detect(color).map(Some);
        };
        let found = detector.detect(&read_color_image(stored)?)?;
        Ok(Some(found.iter().filter_map(|one| rectifier.rectify_detection(one)).collect()))
    }

    /// The stored colour image of a frame whose own image is rectified, and the rectification from one to the
    /// other.
    fn stored_color(&self, index: usize) -> Option<(&Path, &Rectifier)> {
        let Self::Recorded(recording) = self else { return None };
        let dataset = recording.source.dataset();
        Some((dataset.frames().get(index)?.color.as_deref()?, dataset.rectifier()?))
    }

    /// Takes a frame back so that the next one can reuse its buffers.
    pub fn recycle(&mut self, frame: SourceFrame) {
        match self {
            Self::Recorded(recording) => recording.buffers.recycle(frame.frame),
            Self::Bag(bag) => bag.buffers.recycle(frame.frame),
            Self::Synthetic(_) => {}
        }
    }

    /// The exact masks of people in a frame; `None` when the source has no masks.
    ///
    /// # Errors
    ///
    /// When the frame's mask cannot be read.
    pub fn people(&self, index: usize) -> Result<Option<PeopleMasks>, AnyError> {
        let Self::Recorded(recording) = self else { return Ok(None) };
        let masks = recording.folder.join("masks");
        let camera = recording.source.dataset().camera();
        let color = recording.source.dataset().frames().get(index).and_then(|frame| frame.color.as_ref());
        let (true, Some(name)) = (masks.is_dir(), color.and_then(|color| color.file_stem())) else {
            return Ok(None);
        };
        match masks.join(name).with_extension("png") {
            path if path.exists() => Ok(Some(PeopleMasks::read(&path)?)),
            // Frames without people have no mask.
            _ => Ok(Some(PeopleMasks::nobody(camera.width(), camera.height()))),
        }
    }
}

impl From<RecordedFrame> for SourceFrame {
    fn from(loaded: RecordedFrame) -> Self {
        let RecordedFrame { frame, detections, world_from_camera, .. } = loaded;
        Self { frame, detections, world_from_camera }
    }
}
