use std::path::{Path, PathBuf};

use dymlm_core::{ColorImage, DepthImage, Frame, PinholeCamera, Pose, Rgb};

use super::camera_file::read_camera;
use super::lists::{Lists, read_lists};
use super::options::TumOptions;
use crate::image_file::{DecodeBuffers, decode_color, decode_depth};
use crate::trajectory::TrajectoryFile;
use crate::{Error, Trajectory, TrajectoryGap, UncoveredTime};

/// A TUM RGB-D dataset: lists of images, a trajectory and a camera, opened; the images are read one frame at a time.
///
/// Its folder holds
/// - `camera.json`: {width, height, fx, fy, cx, cy, `depth_scale`}; depth in metres = stored value / `depth_scale`;
/// - `associations.txt`: a line `timestamp rgb-file timestamp depth-file` a frame, or depth first: which column is
///   which shows in the names; or, when there is none, `rgb.txt` and `depth.txt`, lines `timestamp filename`, which
///   are then paired one to one by the nearest time (colour may be missing altogether: no `rgb.txt`);
/// - `groundtruth.txt` ([`Trajectory`]), unless the options name another trajectory.
///
/// Frames are in time order. A frame's time is its depth image's: the points come from there. Its pose is the
/// trajectory's, interpolated to that time.
///
/// Whatever spoils one frame leaves the others alone: bad lines of the lists are told by [`Self::faults`], and a frame
/// without pose or with a broken image gives its error when it is loaded.
///
/// ```no_run
/// use dymlm_io::{FrameBuffers, TumDataset, TumOptions};
///
/// let dataset = TumDataset::open("rgbd_dataset_freiburg3_walking_xyz", &TumOptions::default())?;
/// let mut buffers = FrameBuffers::default();
/// for index in 0..dataset.frames().len() {
///     match dataset.load_into(index, &mut buffers) {
///         Ok(posed) => {
///             // ... insert posed.frame at posed.world_from_camera, then give its buffers back:
///             buffers.recycle(posed.frame);
///         }
///         Err(error) => eprintln!("skipped: {error}"),
///     }
/// }
/// # Ok::<(), dymlm_io::Error>(())
/// ```
#[derive(Debug)]
pub struct TumDataset {
    folder: PathBuf,
    camera: PinholeCamera,
    depth_scale: f64,
    frames: Vec<TumFrame>,
    trajectory_path: PathBuf,
    trajectory: TrajectoryFile,
    max_interpolation_gap: f64,
    faults: Vec<Error>,
    unpaired_depth_images: usize,
}

/// One frame of a dataset, not loaded yet.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct TumFrame {
    /// Time of the depth image, seconds: the frame's time.
    pub timestamp: f64,
    /// Time of the colour image, seconds: the time that detections bear.
    pub color_timestamp: Option<f64>,
    /// The depth image.
    pub depth: PathBuf,
    /// The colour image.
    pub color: Option<PathBuf>,
    /// The pose at the frame's time, or why there is none.
    pub world_from_camera: Result<Pose, UncoveredTime>,
    pub(super) depth_listing: Listing,
    pub(super) color_listing: Listing,
}

/// Where an image is listed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Listing {
    pub(super) list: &'static str,
    pub(super) line: usize,
}

/// A loaded frame and where it was seen from.
#[derive(Debug, Clone, PartialEq)]
pub struct PosedFrame {
    /// The frame.
    pub frame: Frame,
    /// Takes camera coordinates to the world.
    pub world_from_camera: Pose,
}

/// Buffers that frames are loaded through, so that loading a sequence allocates next to nothing per frame.
#[derive(Debug, Clone, Default)]
pub struct FrameBuffers {
    decode: DecodeBuffers,
    depth: Vec<f32>,
    color: Vec<Rgb>,
}

impl FrameBuffers {
    /// Takes a frame's image buffers back, for the next frame.
    pub fn recycle(&mut self, frame: Frame) {
        let (depth, color) = frame.into_images();
        self.depth = depth.into_data();
        if let Some(color) = color {
            self.color = color.into_data();
        }
    }
}

const GROUND_TRUTH: &str = "groundtruth.txt";
const CAMERA: &str = "camera.json";

impl TumDataset {
    /// Opens a dataset: reads its lists, its trajectory and its camera, no image.
    ///
    /// # Errors
    ///
    /// Only what makes the whole dataset unusable: options out of range, no readable `camera.json`, no list of depth
    /// images, no readable trajectory, no usable frame at all.
    pub fn open(folder: impl AsRef<Path>, options: &TumOptions) -> Result<Self, Error> {
        options.validate()?;
        let folder = folder.as_ref();
        let (camera, depth_scale) = read_camera(&folder.join(CAMERA))?;
        let Lists { mut frames, mut faults, unpaired_depth_images } = read_lists(folder, options)?;
        let trajectory_path = options.trajectory.clone().unwrap_or_else(|| folder.join(GROUND_TRUTH));
        let trajectory = read_trajectory(&trajectory_path, &mut faults)?;

        frames.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
        let mut frames: Vec<TumFrame> = frames.into_iter().step_by(options.every).collect();
        for frame in &mut frames {
            frame.world_from_camera =
                trajectory.trajectory.pose_at(frame.timestamp, options.max_interpolation_gap);
        }
        Ok(Self {
            folder: folder.to_path_buf(),
            camera,
            depth_scale,
            frames,
            trajectory_path,
            trajectory,
            max_interpolation_gap: options.max_interpolation_gap,
            faults,
            unpaired_depth_images,
        })
    }

    /// The camera.
    pub fn camera(&self) -> &PinholeCamera {
        &self.camera
    }

    /// Stored depth units in a metre.
    pub fn depth_scale(&self) -> f64 {
        self.depth_scale
    }

    /// The frames, in time order; with [`TumOptions::every`] applied.
    pub fn frames(&self) -> &[TumFrame] {
        &self.frames
    }

    /// The trajectory.
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory.trajectory
    }

    /// The stretches of the trajectory that are not interpolated over, in time order.
    pub fn gaps(&self) -> Vec<TrajectoryGap> {
        self.trajectory().gaps(self.max_interpolation_gap)
    }

    /// Lines of the lists and of the trajectory that could not be used, each as an error naming file and line.
    pub fn faults(&self) -> &[Error] {
        &self.faults
    }

    /// Number of depth images left out because no colour image is near enough in time.
    pub fn unpaired_depth_images(&self) -> usize {
        self.unpaired_depth_images
    }

    /// Loads a frame: decodes its images and checks them against the camera.
    ///
    /// # Errors
    ///
    /// [`Error::NoFrame`]; [`Error::Uncovered`] when the trajectory does not cover the frame; [`Error::Listed`], which
    /// says where the image is listed, when an image is missing, broken, of another size than the camera or, for
    /// depth, of another format than 16-bit greyscale PNG.
    pub fn load(&self, index: usize) -> Result<PosedFrame, Error> {
        self.load_into(index, &mut FrameBuffers::default())
    }

    /// As [`Self::load`], through buffers that are kept between calls.
    ///
    /// # Errors
    ///
    /// As [`Self::load`].
    pub fn load_into(&self, index: usize, buffers: &mut FrameBuffers) -> Result<PosedFrame, Error> {
        let frame = self.frames.get(index).ok_or(Error::NoFrame { index, count: self.frames.len() })?;
        let world_from_camera = frame.world_from_camera.map_err(|fault| Error::Uncovered {
            path: self.trajectory_path.clone(),
            line: self.trajectory.line_at(frame.timestamp),
            fault,
        })?;
        let depth = self
            .load_depth(&frame.depth, buffers)
            .map_err(|fault| self.listed(frame.depth_listing, fault))?;
        let color = match &frame.color {
            Some(color) => Some(
                self.load_color(color, buffers).map_err(|fault| self.listed(frame.color_listing, fault))?,
            ),
            None => None,
        };
        let frame = Frame::new(frame.timestamp, self.camera, depth, color)
            .map_err(|error| Error::malformed(&frame.depth, error.to_string()))?;
        Ok(PosedFrame { frame, world_from_camera })
    }

    fn load_depth(&self, path: &Path, buffers: &mut FrameBuffers) -> Result<DepthImage, Error> {
        let depth = std::mem::take(&mut buffers.depth);
        let (width, height, depth) =
            decode_depth(path, self.depth_scale, Some(&self.camera), &mut buffers.decode, depth)?;
        DepthImage::new(width, height, depth).map_err(|error| Error::malformed(path, error.to_string()))
    }

    fn load_color(&self, path: &Path, buffers: &mut FrameBuffers) -> Result<ColorImage, Error> {
        let color = std::mem::take(&mut buffers.color);
        let (width, height, color) = decode_color(path, Some(&self.camera), &mut buffers.decode, color)?;
        ColorImage::new(width, height, color).map_err(|error| Error::malformed(path, error.to_string()))
    }

    fn listed(&self, listing: Listing, fault: Error) -> Error {
        Error::Listed { list: self.folder.join(listing.list), line: listing.line, fault: Box::new(fault) }
    }
}

fn read_trajectory(path: &Path, faults: &mut Vec<Error>) -> Result<TrajectoryFile, Error> {
    let mut file = TrajectoryFile::read(path)?;
    if file.trajectory.poses().is_empty() {
        // The first bad line says more than that there is no good one.
        let fault = file.faults.into_iter().next();
        return Err(fault.unwrap_or_else(|| Error::malformed(path, "the trajectory has no pose")));
    }
    faults.append(&mut file.faults);
    Ok(file)
}
