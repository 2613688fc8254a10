use std::path::{Path, PathBuf};

use dymlm_core::{Frame, PinholeCamera, Rectifier};

use super::camera_file::read_camera;
use super::frame::{Listing, PosedFrame, TumFrame};
use super::image_reader::{FrameBuffers, ImageReader};
use super::lists::{Lists, read_lists};
use super::options::TumOptions;
use crate::trajectory::TrajectoryFile;
use crate::{DetectionFile, Error, Trajectory, TrajectoryGap};

/// An open TUM RGB-D dataset: lists of images, a trajectory and a camera. Images are read one frame at a
/// time.
///
/// Its folder holds
/// - `camera.json`: {width, height, fx, fy, cx, cy, `depth_scale`}; depth in metres = stored value /
///   `depth_scale`. For a lens with distortion it also has `distortion`: {`model`: "`brown_conrady`" or
///   "`equidistant`", `coefficients`: in `OpenCV`'s order}, and frames are rectified. For depth images that
///   are not registered to the colour images it also has `depth_camera`: {width, height, fx, fy, cx, cy,
///   `color_from_depth`: {translation, quaternion}, and perhaps its own `distortion`}, and they are
///   registered. Without `camera.json`, a folder with freiburg1, 2 or 3 in its name has that
///   [`TumCamera`](crate::TumCamera);
/// - `associations.txt`: one line per frame, `timestamp rgb-file timestamp depth-file` or depth first; the
///   file names tell which column is which. Without it, `rgb.txt` and `depth.txt`, lines `timestamp
///   filename`, are paired one to one by the nearest time; without `rgb.txt`, frames have no colour;
/// - `groundtruth.txt` ([`Trajectory`]), unless the options name another trajectory.
///
/// Frames are in time order. A frame's time is that of its depth image, since its points come from there. Its
/// pose is the trajectory's, interpolated at that time.
///
/// A fault in one frame does not affect the others: [`Self::faults`] reports bad lines of the lists, and
/// loading a frame without a pose or with a broken image is an error.
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
    images: ImageReader,
    frames: Vec<TumFrame>,
    /// The times of all listed frames as a detector sees them, also of those that are left out by
    /// [`TumOptions::every`]: their detections are no other frame's.
    seen_at: Vec<f64>,
    every: usize,
    trajectory_path: PathBuf,
    trajectory: TrajectoryFile,
    max_interpolation_gap: f64,
    faults: Vec<Error>,
    unpaired_depth_images: usize,
}

const GROUND_TRUTH: &str = "groundtruth.txt";

impl TumDataset {
    /// Opens a dataset: reads its lists, its trajectory and its camera, but no image.
    ///
    /// # Errors
    ///
    /// Only faults that make the whole dataset unusable: options out of range, neither a readable
    /// `camera.json` nor another camera, no list of depth images, no readable trajectory, or no usable frame.
    pub fn open(folder: impl AsRef<Path>, options: &TumOptions) -> Result<Self, Error> {
        options.validate()?;
        let folder = folder.as_ref();
        let images = ImageReader::new(&read_camera(folder, options.camera)?);
        let Lists { mut frames, mut faults, unpaired_depth_images } = read_lists(folder, options)?;
        let trajectory_path = options.trajectory.clone().unwrap_or_else(|| folder.join(GROUND_TRUTH));
        let trajectory = if options.without_poses {
            TrajectoryFile::default()
        } else {
            read_trajectory(&trajectory_path, &mut faults)?
        };

        frames.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
        let seen_at = frames.iter().map(TumFrame::seen_at).collect();
        let mut frames: Vec<TumFrame> = frames.into_iter().step_by(options.every).collect();
        for frame in &mut frames {
            frame.world_from_camera =
                trajectory.trajectory.pose_at(frame.timestamp, options.max_interpolation_gap);
        }
        Ok(Self {
            folder: folder.to_path_buf(),
            images,
            frames,
            seen_at,
            every: options.every,
            trajectory_path,
            trajectory,
            max_interpolation_gap: options.max_interpolation_gap,
            faults,
            unpaired_depth_images,
        })
    }

    /// The camera of the frames.
    #[doc(alias = "intrinsics")]
    pub fn camera(&self) -> &PinholeCamera {
        self.images.camera()
    }

    /// The rectifier of a camera with distortion, which takes pixels of the stored colour images to pixels of
    /// the frames: detections in stored images go through [`Rectifier::rectify_detection`].
    pub fn rectifier(&self) -> Option<&Rectifier> {
        self.images.rectifier()
    }

    /// Stored depth units in a metre.
    pub fn depth_scale(&self) -> f64 {
        self.images.depth_scale()
    }

    /// The frames that [`TumOptions::every`] selects, in time order.
    pub fn frames(&self) -> &[TumFrame] {
        &self.frames
    }

    /// For each frame, what [`DetectionFile::lines_of`] finds among all listed frames.
    pub(super) fn lines_of(&self, detections: &DetectionFile) -> Vec<Option<usize>> {
        detections.lines_of(&self.seen_at).into_iter().step_by(self.every).collect()
    }

    /// The trajectory.
    pub fn trajectory(&self) -> &Trajectory {
        &self.trajectory.trajectory
    }

    /// The intervals between poses that are too long for interpolation, in time order.
    pub fn gaps(&self) -> Vec<TrajectoryGap> {
        self.trajectory().gaps(self.max_interpolation_gap)
    }

    /// Lines of the lists and of the trajectory that could not be used, each as an error naming file and
    /// line.
    pub fn faults(&self) -> &[Error] {
        &self.faults
    }

    /// Number of depth images left out because no colour image is near enough in time.
    pub fn unpaired_depth_images(&self) -> usize {
        self.unpaired_depth_images
    }

    /// One warning for each fault of the lists and the trajectory that does not prevent all frames from being
    /// loaded.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings: Vec<String> = self.faults.iter().map(ToString::to_string).collect();
        if self.unpaired_depth_images > 0 {
            let unpaired = self.unpaired_depth_images;
            warnings
                .push(format!("{unpaired} depth images have no colour image near in time and are left out"));
        }
        let gap = |gap: TrajectoryGap| format!("no poses between {:.3} and {:.3} s", gap.from, gap.to);
        warnings.extend(self.gaps().into_iter().map(gap));
        warnings
    }

    /// Loads a frame: decodes its images and checks them against the camera.
    ///
    /// # Errors
    ///
    /// [`Error::NoFrame`]; [`Error::Uncovered`] when the trajectory does not cover the frame;
    /// [`Error::Listed`], which says where the image is listed, when an image is missing, broken, of another
    /// size than the camera or, for depth, of another format than 16-bit greyscale PNG.
    pub fn load(&self, index: usize) -> Result<PosedFrame, Error> {
        self.load_into(index, &mut FrameBuffers::default())
    }

    /// As [`Self::load`], with buffers that are reused between calls.
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
            .images
            .depth(&frame.depth, buffers)
            .map_err(|fault| self.listed(frame.depth_listing, fault))?;
        let color = match &frame.color {
            Some(color) => Some(
                self.images.color(color, buffers).map_err(|fault| self.listed(frame.color_listing, fault))?,
            ),
            None => None,
        };
        let frame = Frame::new(frame.timestamp, *self.camera(), depth, color)
            .map_err(|error| Error::malformed(&frame.depth, error.to_string()))?;
        Ok(PosedFrame { frame, world_from_camera })
    }

    fn listed(&self, listing: Listing, fault: Error) -> Error {
        Error::Listed { list: self.folder.join(listing.list), line: listing.line, fault: Box::new(fault) }
    }
}

fn read_trajectory(path: &Path, faults: &mut Vec<Error>) -> Result<TrajectoryFile, Error> {
    let mut file = TrajectoryFile::read(path)?;
    if file.trajectory.poses().is_empty() {
        // The first bad line says more than "no pose".
        let fault = file.faults.into_iter().next();
        return Err(fault.unwrap_or_else(|| Error::malformed(path, "the trajectory has no pose")));
    }
    faults.append(&mut file.faults);
    Ok(file)
}
