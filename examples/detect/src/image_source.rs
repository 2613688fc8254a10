use std::path::Path;

use dymlm::core::ColorImage;
use dymlm_io::{Error, FrameBuffers, McapOptions, McapRecording, TumDataset, TumOptions, read_color_image};

/// The colour images of a recording's frames, one after the other.
///
/// The images of a folder are those stored in it, to which the boxes of its `detections.jsonl` refer; the
/// images of a bag are rectified, as in its frames.
#[derive(Debug)]
pub enum ImageSource {
    /// A TUM RGB-D folder.
    Tum(Box<TumDataset>),
    /// A ROS 2 bag.
    Bag(Box<McapRecording>, FrameBuffers),
}

impl ImageSource {
    /// Opens a TUM RGB-D folder, which needs no trajectory, or an MCAP file; only every `every`-th frame is used.
    ///
    /// # Errors
    ///
    /// As [`TumDataset::open`] and [`McapRecording::open`].
    pub fn open(dataset: &Path, every: usize) -> Result<Self, Error> {
        if dataset.is_file() {
            let mut options = McapOptions::default();
            (options.every, options.without_detections) = (every, true);
            let recording = McapRecording::open(dataset, &options)?;
            return Ok(Self::Bag(Box::new(recording), FrameBuffers::default()));
        }
        let mut options = TumOptions::default();
        (options.every, options.without_poses) = (every, true);
        Ok(Self::Tum(Box::new(TumDataset::open(dataset, &options)?)))
    }

    /// Number of frames.
    pub fn len(&self) -> usize {
        match self {
            Self::Tum(dataset) => dataset.frames().len(),
            Self::Bag(bag, _) => bag.frames().len(),
        }
    }

    /// Whether there is no frame.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Problems in the recording's lists, one warning for each.
    pub fn warnings(&self) -> Vec<String> {
        match self {
            Self::Tum(dataset) => dataset.warnings(),
            Self::Bag(bag, _) => bag.warnings().to_vec(),
        }
    }

    /// The time for detections in a frame, seconds: that of its colour image.
    pub fn timestamp(&self, index: usize) -> Option<f64> {
        let (color, depth) = match self {
            Self::Tum(dataset) => {
                dataset.frames().get(index).map(|frame| (frame.color_timestamp, frame.timestamp))?
            }
            Self::Bag(bag, _) => {
                bag.frames().get(index).map(|frame| (frame.color_timestamp, frame.timestamp))?
            }
        };
        Some(color.unwrap_or(depth))
    }

    /// A frame's colour image; `None` when it has none.
    ///
    /// # Errors
    ///
    /// [`Error::NoFrame`]; when the image cannot be read; for a bag, also when the frame has no pose.
    pub fn load(&mut self, index: usize) -> Result<Option<ColorImage>, Error> {
        match self {
            Self::Tum(dataset) => {
                let count = dataset.frames().len();
                let frame = dataset.frames().get(index).ok_or(Error::NoFrame { index, count })?;
                frame.color.as_ref().map(read_color_image).transpose()
            }
            Self::Bag(bag, buffers) => Ok(bag.load(index, buffers)?.frame.into_images().1),
        }
    }
}
