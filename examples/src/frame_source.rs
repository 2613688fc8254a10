use std::path::{Path, PathBuf};

use dymlm::core::{Detection, Frame, PinholeCamera, Pose};
use dymlm_io::{DetectionFile, FrameBuffers, TumDataset, TumOptions, YoloFolder, read_class_names};
use dymlm_sim::{Sequence, SequenceConfig};

use crate::{AnyError, PeopleMasks};

/// Where frames come from: a recorded dataset, or the built-in synthetic sequence.
#[derive(Debug)]
pub enum FrameSource {
    /// A TUM RGB-D folder.
    Recorded(Box<Recording>),
    /// People walking through a rendered office.
    Synthetic(Box<Sequence>),
}

/// A dataset with its detections.
#[derive(Debug)]
pub struct Recording {
    folder: PathBuf,
    dataset: TumDataset,
    detections: Detections,
    buffers: FrameBuffers,
}

#[derive(Debug)]
enum Detections {
    None,
    File(DetectionFile),
    Yolo(YoloFolder),
}

/// One frame with what was detected in it and where it was seen from.
#[derive(Debug)]
pub struct SourceFrame {
    /// The frame.
    pub frame: Frame,
    /// Detections of all labels; `None` when the detector did not look at the frame.
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
    /// there); without it the dataset's own `detections.jsonl` is taken, if there is one.
    ///
    /// # Errors
    ///
    /// When the dataset or the detections cannot be opened.
    pub fn recorded(
        folder: &Path,
        detections: Option<&Path>,
        options: &TumOptions,
    ) -> Result<Self, AnyError> {
        let dataset = TumDataset::open(folder, options)?;
        let own = folder.join("detections.jsonl");
        let detections = match detections.map(Path::to_path_buf).or_else(|| own.exists().then_some(own)) {
            None => Detections::None,
            Some(path) => open_detections(&path, dataset.camera())?,
        };
        let buffers = FrameBuffers::default();
        Ok(Self::Recorded(Box::new(Recording { folder: folder.to_path_buf(), dataset, detections, buffers })))
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        match self {
            Self::Recorded(recording) => recording.dataset.frames().len(),
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
            Self::Recorded(recording) => recording.dataset.frames().get(index)?.world_from_camera.ok(),
            Self::Synthetic(sequence) => (index < sequence.len()).then(|| sequence.world_from_camera(index)),
        }
    }

    /// The time of a frame, seconds, without loading its images.
    pub fn timestamp(&self, index: usize) -> Option<f64> {
        match self {
            Self::Recorded(recording) => Some(recording.dataset.frames().get(index)?.timestamp),
            Self::Synthetic(sequence) => (index < sequence.len()).then(|| sequence.timestamp(index)),
        }
    }

    /// Faults of the dataset's lists and detections that concern no frame that can be loaded, worth a
    /// warning.
    pub fn faults(&self) -> Vec<String> {
        let Self::Recorded(recording) = self else { return Vec::new() };
        let mut faults: Vec<String> = recording.dataset.faults().iter().map(ToString::to_string).collect();
        let unpaired = recording.dataset.unpaired_depth_images();
        if unpaired > 0 {
            faults
                .push(format!("{unpaired} depth images have no colour image near in time and are left out"));
        }
        let gaps = recording.dataset.gaps();
        faults.extend(gaps.iter().map(|gap| format!("no poses between {:.3} and {:.3} s", gap.from, gap.to)));
        match &recording.detections {
            Detections::None => {
                faults.push("no detections: only late removal keeps movers out of the map".into());
            }
            Detections::File(file) => faults.extend(file.faults().iter().map(ToString::to_string)),
            Detections::Yolo(_) => {}
        }
        faults
    }

    /// Loads a frame.
    ///
    /// # Errors
    ///
    /// What is wrong with this frame; the others are not concerned.
    pub fn load(&mut self, index: usize) -> Result<SourceFrame, AnyError> {
        match self {
            Self::Recorded(recording) => recording.load(index),
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

    /// Takes a frame back whose buffers the next one may use.
    pub fn recycle(&mut self, frame: SourceFrame) {
        if let Self::Recorded(recording) = self {
            recording.buffers.recycle(frame.frame);
        }
    }

    /// Who is where in a frame, exactly; `None` when the source has no masks.
    ///
    /// # Errors
    ///
    /// When the frame's mask cannot be read.
    pub fn people(&self, index: usize) -> Result<Option<PeopleMasks>, AnyError> {
        let Self::Recorded(recording) = self else { return Ok(None) };
        let masks = recording.folder.join("masks");
        let camera = recording.dataset.camera();
        let color = recording.dataset.frames().get(index).and_then(|frame| frame.color.as_ref());
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

impl Recording {
    fn load(&mut self, index: usize) -> Result<SourceFrame, AnyError> {
        let listed = self.dataset.frames().get(index).ok_or("no such frame")?;
        let time = listed.color_timestamp.unwrap_or(listed.timestamp);
        let detections = match &self.detections {
            Detections::None => None,
            Detections::File(file) => file.at(time)?.map(<[_]>::to_vec),
            Detections::Yolo(folder) => Some(folder.read(listed.color.as_ref().unwrap_or(&listed.depth))?),
        };
        let rectified = |found: Vec<Detection>| match self.dataset.rectifier() {
            Some(rectifier) => found.iter().filter_map(|one| rectifier.rectify_detection(one)).collect(),
            None => found,
        };
        let detections = detections.map(rectified);
        let posed = self.dataset.load_into(index, &mut self.buffers)?;
        Ok(SourceFrame { frame: posed.frame, detections, world_from_camera: posed.world_from_camera })
    }
}

fn open_detections(path: &Path, camera: &PinholeCamera) -> Result<Detections, AnyError> {
    if path.is_dir() {
        let names = read_class_names(path.join("names.txt"))?;
        return Ok(Detections::Yolo(YoloFolder::open(path, names, camera.width(), camera.height())?));
    }
    Ok(Detections::File(DetectionFile::open(path, DetectionFile::DEFAULT_TOLERANCE)?))
}
