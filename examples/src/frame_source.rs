use std::path::{Path, PathBuf};

use dymlm::core::{Detection, Frame, Mask, PinholeCamera, Pose};
use dymlm_io::{DetectionFile, FrameBuffers, TumDataset, TumOptions, YoloFolder, read_class_names};
use dymlm_sim::{Sequence, SequenceConfig};

use crate::AnyError;

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
    /// Detections of all labels.
    pub detections: Vec<Detection>,
    /// Camera to world.
    pub world_from_camera: Pose,
    /// The pixels that show movers, where the source knows them exactly.
    pub mover_mask: Option<Mask>,
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

    /// A recorded dataset. `detections` is a JSON-lines file or a YOLO folder (class names in `names.txt` there);
    /// without it the dataset's own `detections.jsonl` is taken, if there is one.
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
        Ok(Self::Recorded(Box::new(Recording { dataset, detections, buffers })))
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

    /// Faults of the dataset's lists and detections that concern no frame that can be loaded, worth a warning.
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
                    detections: frame.detections,
                    world_from_camera: frame.world_from_camera,
                    mover_mask: Some(frame.mover_mask),
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

    /// The colour image file of a frame of a recorded dataset.
    pub fn color_path(&self, index: usize) -> Option<PathBuf> {
        let Self::Recorded(recording) = self else { return None };
        recording.dataset.frames().get(index)?.color.clone()
    }
}

impl Recording {
    fn load(&mut self, index: usize) -> Result<SourceFrame, AnyError> {
        let listed = self.dataset.frames().get(index).ok_or("no such frame")?;
        let time = listed.color_timestamp.unwrap_or(listed.timestamp);
        let detections = match &self.detections {
            Detections::None => Vec::new(),
            Detections::File(file) => file.at(time)?.map(<[_]>::to_vec).unwrap_or_default(),
            Detections::Yolo(folder) => folder.read(listed.color.as_ref().unwrap_or(&listed.depth))?,
        };
        let posed = self.dataset.load_into(index, &mut self.buffers)?;
        Ok(SourceFrame {
            frame: posed.frame,
            detections,
            world_from_camera: posed.world_from_camera,
            mover_mask: None,
        })
    }
}

fn open_detections(path: &Path, camera: &PinholeCamera) -> Result<Detections, AnyError> {
    if path.is_dir() {
        let names = read_class_names(path.join("names.txt"))?;
        return Ok(Detections::Yolo(YoloFolder::open(path, names, camera.width(), camera.height())?));
    }
    Ok(Detections::File(DetectionFile::open(path, DetectionFile::DEFAULT_TOLERANCE)?))
}
