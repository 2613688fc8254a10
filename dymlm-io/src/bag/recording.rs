use std::path::{Path, PathBuf};

use dymlm_core::{
    ColorImage, DepthImage, DepthRegistration, Detection, Frame, PinholeCamera, Pose, Rectifier,
};

use super::bag_file::{BagFile, Place};
use super::camera_info::InfoCamera;
use super::catalogue::{Catalogue, Listed};
use super::detections::detections_of;
use super::options::McapOptions;
use super::pictures::{color_of, depth_of};
use super::topics::{color_topic, depth_topic, unread_colors, with_camera};
use super::transforms::{NoTransform, frame_name};
use crate::ros2::messages::TransformStamped;
use crate::tum::association::associate;
use crate::tum::image_reader::CameraPair;
use crate::{Error, FrameBuffers, RecordedFrame, Trajectory};

/// A ROS 2 bag in MCAP: posed RGB-D frames with detections.
///
/// Opening a bag reads it once, to list where its images and detections lie and to collect all transforms, in
/// whatever order they were recorded. Then frames are read one by one, in any order: no more than one frame
/// and a few chunks are in memory, however long the bag is. Chunks may be compressed by zstd or lz4.
///
/// - Images: `sensor_msgs` `Image` (depth 16UC1 in millimetres, 32FC1 in metres; colour rgb8, bgr8, rgba8,
///   bgra8, mono8) and `CompressedImage` (JPEG, PNG; `compressedDepth` by PNG). Colour and depth are paired
///   one to one by their time stamps. Lens distortion is removed as their `CameraInfo` says. Depth of another
///   camera or tf frame is registered to the colour images by the fixed transforms between the two.
/// - Poses: `TFMessage` on `tf` and `tf_static`, or `Odometry`. Each transform between camera and world is
///   interpolated at the depth image's time stamp, never extrapolated.
/// - Detections: `Detection2DArray`, of the colour image nearest in time.
///
/// Loading a frame without a pose or with a broken image is an error; other frames still load. A truncated
/// bag is read up to its end. [`Self::warnings`] says what is left out, and how much.
#[derive(Debug)]
pub struct McapRecording {
    bag: BagFile,
    frames: Vec<McapFrame>,
    cameras: CameraPair,
    depth: Source,
    color: Option<Source>,
    class_names: Vec<String>,
    warnings: Vec<String>,
}

/// One frame of a bag, not loaded yet.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct McapFrame {
    /// Time stamp of the depth image, seconds: the frame's time.
    pub timestamp: f64,
    /// Time stamp of the colour image, seconds.
    pub color_timestamp: Option<f64>,
    /// The pose at the frame's time, or why there is none.
    pub world_from_camera: Result<Pose, NoTransform>,
    depth: Place,
    color: Option<Place>,
    detections: Option<Place>,
}

/// A topic of images.
#[derive(Debug)]
struct Source {
    /// The bag and the topic, for errors.
    path: PathBuf,
    is_compressed: bool,
    camera: PinholeCamera,
}

impl McapRecording {
    /// Opens a bag: reads all of it once and keeps no image.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Config`] for options out of range; [`Error::Malformed`] when the file is not
    /// MCAP, has no depth images with a camera, has depth that cannot be registered to colour, or lacks a
    /// topic that the options name; as [`Trajectory::read`] when the options name a trajectory.
    pub fn open(path: impl AsRef<Path>, options: &McapOptions) -> Result<Self, Error> {
        options.validate()?;
        let path = path.as_ref();
        let malformed = |reason: String| Error::malformed(path, reason);
        let mut bag = BagFile::open(path)?;
        let mut catalogue = Catalogue::of(&mut bag)?;
        add_odometry(&mut catalogue, options.odometry.as_deref()).map_err(malformed)?;
        catalogue.tree.settle().map_err(|error| malformed(error.to_string()))?;

        let opened = || -> Result<_, String> {
            let depth = depth_topic(&catalogue, options.depth.as_deref())?;
            let depth = with_camera(&catalogue, depth, options.depth_info.as_deref())?;
            let depth_frame = frame_of(&catalogue, &depth.topic);
            let color = color_topic(&catalogue, options.color.as_deref(), depth_frame)?;
            let color = color
                .map(|topic| with_camera(&catalogue, topic, options.color_info.as_deref()))
                .transpose()?;
            let cameras = match &color {
                None => camera_pair(&depth.camera, &depth.camera, None),
                Some(color) => {
                    let color_frame = frame_of(&catalogue, &color.topic);
                    let apart = frame_name(color_frame) != frame_name(depth_frame);
                    let color_from_depth = if apart {
                        let between = catalogue.tree.fixed_between(depth_frame, color_frame);
                        between.map_err(|error| format!("depth cannot be registered to colour: {error}"))?
                    } else {
                        Pose::identity()
                    };
                    let other = apart || color.camera.camera != depth.camera.camera;
                    camera_pair(&color.camera, &depth.camera, other.then_some(&color_from_depth))
                }
            };
            Ok((depth, color, cameras))
        };
        let (depth, color, cameras) = opened().map_err(malformed)?;
        let detections = if options.without_detections {
            None
        } else {
            detections_topic(&catalogue, options.detections.as_deref()).map_err(malformed)?
        };

        let listed = |topic: &str| catalogue.images.get(topic).map_or(&[][..], |images| &images.images);
        let (depth_images, color_images) =
            (listed(&depth.topic), color.as_ref().map(|color| listed(&color.topic)));
        let mut frames = paired(depth_images, color_images, options.max_association_gap);
        let mut warnings = catalogue.warnings();
        warnings.extend(color.is_none().then(|| unread_colors(&catalogue)).flatten());
        let unpaired = depth_images.len() - frames.len();
        if unpaired > 0 {
            warnings.push(format!(
                "{unpaired} of {} depth images have no colour image within {} s and are left out",
                depth_images.len(),
                options.max_association_gap
            ));
        }
        if frames.is_empty() {
            warnings.push("no frame is left".to_owned());
            return Err(malformed(warnings.join("; ")));
        }
        let found = detections.as_ref().and_then(|topic| catalogue.detections.get(topic));
        let lost =
            add_detections(&mut frames, found.map_or(&[][..], Vec::as_slice), options.max_association_gap);
        if lost > 0 {
            warnings.push(format!("{lost} detection arrays have no image near in time and are left out"));
        }
        if detections.is_none() && !options.without_detections {
            warnings.push("no detections: only late removal keeps movers out of the map".to_owned());
        }

        let mut frames: Vec<McapFrame> = frames.into_iter().step_by(options.every).collect();
        let camera_topic = color.as_ref().map_or(&depth.topic, |color| &color.topic);
        add_poses(&mut frames, &catalogue, frame_of(&catalogue, camera_topic), options)?;
        let unposed = frames.iter().filter_map(|frame| frame.world_from_camera.as_ref().err());
        if let Some(first) = unposed.clone().next() {
            warnings.push(format!(
                "{} of {} frames have no pose, the first: {first}",
                unposed.count(),
                frames.len()
            ));
        }
        let source = |topic: &str, camera: &InfoCamera| Source {
            path: PathBuf::from(format!("{}:{topic}", path.display())),
            is_compressed: catalogue.images.get(topic).is_some_and(|images| images.is_compressed),
            camera: camera.camera,
        };
        let depth = source(&depth.topic, &depth.camera);
        let color = color.map(|color| source(&color.topic, &color.camera));
        Ok(Self { bag, frames, cameras, depth, color, class_names: options.class_names.clone(), warnings })
    }

    /// The camera of the frames: the colour camera, or the depth camera if there is no colour.
    pub fn camera(&self) -> &PinholeCamera {
        &self.cameras.camera
    }

    /// The frames that [`McapOptions::every`] selects, in the order of their depth images' time stamps.
    pub fn frames(&self) -> &[McapFrame] {
        &self.frames
    }

    /// One warning for each kind of thing that is left out, with its number.
    pub fn warnings(&self) -> &[String] {
        &self.warnings
    }

    /// Loads a frame. Boxes of detections are rectified like the colour image.
    ///
    /// # Errors
    ///
    /// [`Error::NoFrame`]; [`Error::NoTransform`] when the frame has no pose; [`Error::Malformed`] and
    /// [`Error::ImageSize`] when an image or its detections cannot be read; [`Error::Io`].
    pub fn load(&mut self, index: usize, buffers: &mut FrameBuffers) -> Result<RecordedFrame, Error> {
        let count = self.frames.len();
        let frame = self.frames.get(index).ok_or(Error::NoFrame { index, count })?;
        let world_from_camera = match &frame.world_from_camera {
            Ok(pose) => *pose,
            Err(fault) => {
                return Err(Error::NoTransform { path: self.bag.path().to_path_buf(), fault: fault.clone() });
            }
        };
        let Self { bag, cameras, depth: depth_source, color: color_source, class_names, .. } = self;
        let malformed = |error: dymlm_core::Error| Error::malformed(&depth_source.path, error.to_string());

        let Source { path, is_compressed, camera } = &*depth_source;
        let (samples, spare) = (&mut buffers.decode.samples, std::mem::take(&mut buffers.depth));
        let depth = depth_of(bag.message(frame.depth)?, *is_compressed, camera, path, samples, spare)?;
        let depth = DepthImage::new(camera.width(), camera.height(), depth).map_err(malformed)?;
        let depth = cameras.pinhole_depth(depth, buffers).map_err(malformed)?;
        let color = match (frame.color, &*color_source) {
            (Some(place), Some(Source { path, is_compressed, camera })) => {
                let spare = std::mem::take(&mut buffers.color);
                let colors = color_of(bag.message(place)?, *is_compressed, camera, path, spare)?;
                let color = ColorImage::new(camera.width(), camera.height(), colors).map_err(malformed)?;
                Some(cameras.pinhole_color(color, buffers).map_err(malformed)?)
            }
            _ => None,
        };
        let detections = match frame.detections {
            None => None,
            Some(place) => {
                let found = detections_of(bag.message(place)?, class_names);
                let found =
                    found.map_err(|reason| Error::malformed(bag.path(), format!("detections: {reason}")))?;
                Some(rectified(cameras.rectifier.as_ref(), found))
            }
        };
        let frame = Frame::new(frame.timestamp, cameras.camera, depth, color).map_err(malformed)?;
        Ok(RecordedFrame { frame, detections, world_from_camera })
    }
}

fn rectified(rectifier: Option<&Rectifier>, found: Vec<Detection>) -> Vec<Detection> {
    match rectifier {
        Some(rectifier) => found.iter().filter_map(|one| rectifier.rectify_detection(one)).collect(),
        None => found,
    }
}

fn frame_of<'a>(catalogue: &'a Catalogue, topic: &str) -> &'a str {
    catalogue.images.get(topic).map_or("", |images| &images.frame_id)
}

fn camera_pair(color: &InfoCamera, depth: &InfoCamera, color_from_depth: Option<&Pose>) -> CameraPair {
    let rectifier = |info: &InfoCamera| {
        info.distortion.as_ref().map(|lens| Rectifier::new(&info.camera, lens, &info.camera))
    };
    CameraPair {
        camera: color.camera,
        rectifier: rectifier(color),
        depth_camera: depth.camera,
        depth_rectifier: rectifier(depth),
        registration: color_from_depth.map(|pose| DepthRegistration::new(&depth.camera, &color.camera, pose)),
    }
}

/// Adds odometry to the tree: a named topic replaces tf's motion of its child frame; without a name, each
/// topic is used whose child frames have no transform in tf.
fn add_odometry(catalogue: &mut Catalogue, named: Option<&str>) -> Result<(), String> {
    let Catalogue { odometry, tree, faults, .. } = catalogue;
    if let Some(named) = named {
        let given = odometry.remove(named).ok_or_else(|| format!("no odometry on topic {named}"))?;
        for (_, message) in &given {
            tree.remove(&message.child_frame_id);
        }
        take_in(tree, faults, named, &given);
        odometry.clear();
    }
    for (topic, given) in std::mem::take(odometry) {
        if given.iter().all(|(_, message)| !tree.has_parent(&message.child_frame_id)) {
            take_in(tree, faults, &topic, &given);
        }
    }
    Ok(())
}

fn take_in(
    tree: &mut super::transforms::TransformTree,
    faults: &mut std::collections::BTreeSet<String>,
    topic: &str,
    given: &[(f64, TransformStamped)],
) {
    for (recorded, message) in given {
        if let Err(reason) = tree.add(message, false, Some(*recorded)) {
            faults.insert(format!("{topic}: {reason}"));
        }
    }
}

fn detections_topic(catalogue: &Catalogue, named: Option<&str>) -> Result<Option<String>, String> {
    let all: Vec<&str> = catalogue.detections.keys().map(String::as_str).collect();
    match (named, all.as_slice()) {
        (Some(named), all) if all.contains(&named) => Ok(Some(named.to_owned())),
        (Some(named), all) => Err(format!("no detections on topic {named}; there are: {}", all.join(", "))),
        (None, []) => Ok(None),
        (None, [only]) => Ok(Some((*only).to_owned())),
        (None, all) => Err(format!("detections on several topics, name one: {}", all.join(", "))),
    }
}

/// One frame for each depth image; with colour, only for those that have a colour image near in time.
fn paired(depth: &[Listed], color: Option<&[Listed]>, max_gap: f64) -> Vec<McapFrame> {
    let frame = |depth: &Listed, color: Option<&Listed>| McapFrame {
        timestamp: depth.timestamp,
        color_timestamp: color.map(|color| color.timestamp),
        world_from_camera: Ok(Pose::identity()),
        depth: depth.place,
        color: color.map(|color| color.place),
        detections: None,
    };
    let Some(color) = color else { return depth.iter().map(|depth| frame(depth, None)).collect() };
    let pairs = associate(&times(color), &times(depth), max_gap);
    pairs.iter().filter_map(|pair| Some(frame(depth.get(pair.depth)?, color.get(pair.color)))).collect()
}

fn times(listed: &[Listed]) -> Vec<f64> {
    listed.iter().map(|listed| listed.timestamp).collect()
}

/// Gives detections to the frames, one to one by time. Returns the number of messages that no frame got.
fn add_detections(frames: &mut [McapFrame], found: &[Listed], max_gap: f64) -> usize {
    // Frames are in the order of their depth images; their colour images may be in another order.
    let seen_at = |frame: &McapFrame| frame.color_timestamp.unwrap_or(frame.timestamp);
    let mut order: Vec<usize> = (0..frames.len()).collect();
    order.sort_by(|&a, &b| match (frames.get(a), frames.get(b)) {
        (Some(a), Some(b)) => seen_at(a).total_cmp(&seen_at(b)),
        _ => a.cmp(&b),
    });
    let seen: Vec<f64> = order.iter().filter_map(|&index| frames.get(index)).map(seen_at).collect();
    let pairs = associate(&seen, &times(found), max_gap);
    for pair in &pairs {
        let frame = order.get(pair.color).and_then(|&index| frames.get_mut(index));
        if let (Some(frame), Some(found)) = (frame, found.get(pair.depth)) {
            frame.detections = Some(found.place);
        }
    }
    found.len() - pairs.len()
}

/// Gives the frames their poses, from the options' trajectory or from the transforms.
fn add_poses(
    frames: &mut [McapFrame],
    catalogue: &Catalogue,
    camera_frame: &str,
    options: &McapOptions,
) -> Result<(), Error> {
    let max_gap = options.max_interpolation_gap;
    if let Some(path) = &options.trajectory {
        let trajectory = Trajectory::read(path)?;
        for frame in frames {
            frame.world_from_camera = trajectory.pose_at(frame.timestamp, max_gap).map_err(NoTransform::from);
        }
        return Ok(());
    }
    let chain = catalogue.tree.chain_to_world(camera_frame, options.world_frame.as_deref());
    for frame in frames {
        frame.world_from_camera = match &chain {
            Ok(chain) => catalogue.tree.pose_at(chain, frame.timestamp, max_gap),
            Err(fault) => Err(fault.clone()),
        };
    }
    Ok(())
}
