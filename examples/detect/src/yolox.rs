use std::path::{Path, PathBuf};

use dymlm::core::{ColorImage, Detection};
use dymlm_examples::{AnyError, FrameDetector};

use crate::network::Network;
use crate::network_input::NetworkInput;
use crate::output_grid::Candidate;
use crate::suppression::suppress;
use crate::{Error, YoloxConfig};

/// A YOLOX network and its config.
///
/// ```no_run
/// use dymlm_detect::{Yolox, YoloxConfig};
///
/// let image = dymlm_io::read_color_image("kitchen.jpg")?;
/// let yolox = Yolox::open("yolox_nano.onnx", YoloxConfig::default())?;
/// for found in yolox.detect(&image)? {
///     println!("{} {:.2} {:?}", found.label(), found.score(), found.bounding_box());
/// }
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug, Clone)]
pub struct Yolox {
    path: PathBuf,
    network: Network,
    config: YoloxConfig,
}

impl Yolox {
    /// Opens a network as YOLOX exports it to ONNX: the input one image, 3 x height x width, blue, green and
    /// red, 0..=255; the output raw, without `--decode_in_inference` (boxes in pixels), but with scores after
    /// the sigmoid. Networks of releases before 0.1.1, which took normalized images, find nothing.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Unreadable`] when the file holds no network that tract can run;
    /// [`Error::NotYolox`] when its input or output differs; [`Error::ClassNames`] when the config's number
    /// of names is not the number of classes; [`Error::Config`].
    pub fn open(path: impl AsRef<Path>, config: YoloxConfig) -> Result<Self, Error> {
        config.validate()?;
        let path = path.as_ref().to_path_buf();
        let network = Network::open(&path)?;
        let (names, classes) = (config.class_names.len(), network.grid().classes());
        if names != classes {
            return Err(Error::ClassNames { path, names, classes });
        }
        Ok(Self { path, network, config })
    }

    /// The network's file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Width and height of the network's input, pixels.
    pub fn input_size(&self) -> [usize; 2] {
        self.network.size()
    }

    /// The detections in an image of any size, with boxes in its pixels, the highest score first. The same
    /// image gives the same bits on the same machine; other processors have other kernels, which round
    /// differently.
    ///
    /// # Errors
    ///
    /// [`Error::ImageSize`] when a side of the image has no pixel at the network's scale; [`Error::Output`]
    /// when a row of the network's output is not a detection; [`Error::Run`].
    pub fn detect(&self, image: &ColorImage) -> Result<Vec<Detection>, Error> {
        let input = NetworkInput::new([image.width(), image.height()], self.network.size())?;
        let output = self.network.run(&input.planes(image))?;
        let candidates = self.network.grid().candidates(&output, self.config.min_score)?;
        let best = suppress(candidates, self.config.max_overlap);
        Ok(best.iter().filter_map(|candidate| self.in_image(candidate, &input)).collect())
    }

    /// `None` when it lies in the padding.
    fn in_image(&self, candidate: &Candidate, input: &NetworkInput) -> Option<Detection> {
        let bounding_box = input.box_in_image(candidate.bounding_box)?;
        let label = self.config.class_names.get(candidate.class)?;
        Detection::new(label, candidate.score, bounding_box).ok()
    }
}

impl FrameDetector for Yolox {
    fn detect(&mut self, image: &ColorImage) -> Result<Vec<Detection>, AnyError> {
        Ok(Yolox::detect(self, image)?)
    }
}
