use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use dymlm_core::{ColorImage, DepthImage, Frame, PinholeCamera, Pose, Rgb};

use super::TumOptions;
use super::association::associate;
use super::list_file::{List, ListedFile, ListedPair, read_files, read_pairs};
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
    depth_listing: Listing,
    color_listing: Listing,
}

/// Where an image is listed.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Listing {
    list: &'static str,
    line: usize,
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

const ASSOCIATIONS: &str = "associations.txt";
const RGB: &str = "rgb.txt";
const DEPTH: &str = "depth.txt";
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

/// What `camera.json` holds; other keys are passed over.
#[derive(serde::Deserialize)]
struct RawCamera {
    width: usize,
    height: usize,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
    depth_scale: f64,
}

fn read_camera(path: &Path) -> Result<(PinholeCamera, f64), Error> {
    let bytes = fs::read(path).map_err(Error::io(path))?;
    let raw: RawCamera = serde_json::from_slice(&bytes)
        .map_err(|error| Error::line(path, error.line().max(1), error.to_string()))?;
    let camera = PinholeCamera::new(raw.width, raw.height, raw.fx, raw.fy, raw.cx, raw.cy)
        .map_err(|error| Error::malformed(path, error.to_string()))?;
    if !(raw.depth_scale.is_finite() && raw.depth_scale > 0.0) {
        let error = dymlm_core::Error::DepthScale(raw.depth_scale);
        return Err(Error::malformed(path, error.to_string()));
    }
    Ok((camera, raw.depth_scale))
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

/// Frames as the lists give them, their poses still unknown.
struct Lists {
    frames: Vec<TumFrame>,
    faults: Vec<Error>,
    unpaired_depth_images: usize,
}

fn read_lists(folder: &Path, options: &TumOptions) -> Result<Lists, Error> {
    let associations = folder.join(ASSOCIATIONS);
    let (list, lists) = if associations.exists() {
        let lists = read_associations(folder, &associations)?;
        (associations, lists)
    } else {
        let lists = associate_lists(folder, options.max_association_gap)?;
        (folder.join(DEPTH), lists)
    };
    if lists.frames.is_empty() {
        let reason = match lists.unpaired_depth_images {
            0 => "no frame is listed".to_owned(),
            count => format!(
                "none of {count} depth images has a colour image of {RGB} within {} s",
                options.max_association_gap
            ),
        };
        // The first bad line says more than that there is no good one.
        return Err(lists.faults.into_iter().next().unwrap_or_else(|| Error::malformed(&list, reason)));
    }
    Ok(lists)
}

fn read_associations(folder: &Path, path: &Path) -> Result<Lists, Error> {
    let List { entries, faults } = read_pairs(path)?;
    let depth_first = depth_comes_first(folder, &entries);
    let frames = entries
        .into_iter()
        .map(|ListedPair { first, second }| {
            let (color, depth) = if depth_first { (second, first) } else { (first, second) };
            listed_frame(folder, ASSOCIATIONS, &depth, Some((ASSOCIATIONS, &color)))
        })
        .collect();
    Ok(Lists { frames, faults, unpaired_depth_images: 0 })
}

/// Pairs `rgb.txt` and `depth.txt` by time. Without `rgb.txt` the frames have no colour.
fn associate_lists(folder: &Path, max_gap: f64) -> Result<Lists, Error> {
    let List { entries: depth, mut faults } = read_files(&folder.join(DEPTH))?;
    let rgb = folder.join(RGB);
    if !rgb.exists() {
        let frames = depth.iter().map(|depth| listed_frame(folder, DEPTH, depth, None)).collect();
        return Ok(Lists { frames, faults, unpaired_depth_images: 0 });
    }
    let List { entries: color, faults: color_faults } = read_files(&rgb)?;
    faults.extend(color_faults);
    let pairs = associate(&color, &depth, max_gap);
    let frames = pairs
        .iter()
        .map(|pair| listed_frame(folder, DEPTH, &depth[pair.depth], Some((RGB, &color[pair.color]))))
        .collect();
    Ok(Lists { frames, faults, unpaired_depth_images: depth.len() - pairs.len() })
}

fn listed_frame(
    folder: &Path,
    depth_list: &'static str,
    depth: &ListedFile,
    color: Option<(&'static str, &ListedFile)>,
) -> TumFrame {
    let depth_listing = Listing { list: depth_list, line: depth.line };
    TumFrame {
        timestamp: depth.timestamp,
        color_timestamp: color.map(|(_, file)| file.timestamp),
        depth: folder.join(&depth.path),
        color: color.map(|(_, file)| folder.join(&file.path)),
        world_from_camera: Err(UncoveredTime::Empty { timestamp: depth.timestamp }),
        depth_listing,
        color_listing: color.map_or(depth_listing, |(list, file)| Listing { list, line: file.line }),
    }
}

/// Whether `associations.txt` gives the depth image first. Each line votes by what its names are in `rgb.txt` and
/// `depth.txt`, or else look like; without evidence colour comes first, as the benchmark's own tool writes it.
fn depth_comes_first(folder: &Path, pairs: &[ListedPair]) -> bool {
    let names = |list: &str| -> BTreeSet<PathBuf> {
        let list = read_files(&folder.join(list)).map(|list| list.entries).unwrap_or_default();
        list.into_iter().map(|file| file.path).collect()
    };
    let (color_names, depth_names) = (names(RGB), names(DEPTH));
    let is_depth = |file: &ListedFile| {
        depth_names.contains(&file.path)
            || (!color_names.contains(&file.path) && looks_like_depth(&file.path))
    };
    let votes = |pair: &ListedPair| i64::from(is_depth(&pair.first)) - i64::from(is_depth(&pair.second));
    pairs.iter().map(votes).sum::<i64>() > 0
}

fn looks_like_depth(path: &Path) -> bool {
    path.to_string_lossy().to_ascii_lowercase().contains("depth")
}
