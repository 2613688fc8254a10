use std::fs::File;
use std::io::{self, BufWriter};
use std::path::{Path, PathBuf};

use dymlm_core::{DepthImage, Detection, Frame, PointCloud, Pose};
use serde::Serialize;

use super::McapWriterOptions;
use super::container::Container;
use super::frame_messages::{camera_info, camera_transform, detection_array};
use super::pictures::{DepthPicture, color_picture, depth_picture};
use super::point_bytes::PointBytes;
use super::scene_entities::{deletion, object_entity, plane_entity, transform};
use crate::ros2::map_messages::{MapMetaData, OccupancyGrid, PointCloud2};
use crate::ros2::messages::{CompressedImage, Header, Image, Time, encode};
use crate::ros2::scene::SceneUpdate;
use crate::{Error, ObjectRecord, PlaneRecord};

/// The tf frames.
const WORLD: &str = "map";
const CAMERA: &str = "camera";

/// Writes a session for viewers: frames, and maps as they grow. The file is a ROS 2 bag in MCAP (messages in
/// CDR, schemas `ros2msg`), for Foxglove, Rerun and the tools of ROS 2;
/// [`McapRecording`](crate::McapRecording) reads its frames back; of frames with and without colour it reads
/// only those with it, and says how many it leaves out.
///
/// | Topic | Message | |
/// |---|---|---|
/// | `/camera/color/image_raw/compressed` | `sensor_msgs/CompressedImage` | JPEG or PNG |
/// | `/camera/depth/image_raw` | `sensor_msgs/Image` | or `.../compressedDepth` |
/// | `/camera/color/camera_info` | `sensor_msgs/CameraInfo` | of both images; `/camera/depth/camera_info` where there is no colour |
/// | `/tf` | `tf2_msgs/TFMessage` | `map` to `camera` (optical) |
/// | `/detections` | `vision_msgs/Detection2DArray` | boxes; masks are not written |
/// | as named | `sensor_msgs/PointCloud2` | x, y, z; with colours also `rgb` and `colors` |
/// | `/map/planes`, `/map/objects` | `foxglove_msgs/SceneUpdate` | changed entities by id |
/// | `/map/grid` | `nav_msgs/OccupancyGrid` | |
///
/// Times are seconds, 0 or later; log times in the bag are the messages' own times. A crash loses the
/// messages of the last megabyte; [`flush`](Self::flush) writes them all. After an error of the system, what
/// was written before can be read, but nothing after it. A writer that is dropped finishes its file if it
/// can.
///
/// ```
/// use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose};
/// use dymlm_io::{FrameBuffers, McapOptions, McapRecording, McapWriter, McapWriterOptions};
///
/// # let folder = tempfile::tempdir()?;
/// # let path = folder.path().join("session.mcap");
/// let camera = PinholeCamera::new(64, 48, 60.0, 60.0, 31.5, 23.5)?;
/// let mut writer = McapWriter::create(&path, &McapWriterOptions::exact())?;
/// for i in 0..3 {
///     let depth = DepthImage::new(64, 48, vec![2.0; 64 * 48])?;
///     let frame = Frame::new(0.1 * f64::from(i), camera, depth, None)?;
///     writer.write_frame(&frame, Some(&[]), &Pose::identity())?;
/// }
/// writer.finish()?;
///
/// let mut recording = McapRecording::open(&path, &McapOptions::default())?;
/// let loaded = recording.load(2, &mut FrameBuffers::default())?;
/// assert_eq!(loaded.frame.depth().at(10, 10), 2.0);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct McapWriter {
    path: PathBuf,
    options: McapWriterOptions,
    /// `None` once the file is finished.
    file: Option<Container<BufWriter<File>>>,
    message: Vec<u8>,
}

/// A 2D occupancy grid in the plane z = 0 of its own axes.
#[derive(Debug, Clone, PartialEq)]
pub struct GridRecord {
    /// Number of cells along x.
    pub width: usize,
    /// Number of cells along y.
    pub height: usize,
    /// Side of a cell, metres.
    pub resolution: f64,
    /// Pose in the world of the lower left corner of cell (0, 0), with the grid's axes.
    pub world_from_grid: Pose,
    /// Row by row from the lowest y: 0 free to 100 occupied, -1 unknown.
    pub cells: Vec<i8>,
}

impl McapWriter {
    /// Begins a file; an existing one is overwritten.
    ///
    /// # Errors
    ///
    /// [`Error::Io`]; [`Error::Config`] for options out of range.
    pub fn create(path: impl AsRef<Path>, options: &McapWriterOptions) -> Result<Self, Error> {
        options.validate()?;
        let path = path.as_ref().to_path_buf();
        let begin = || Container::new(BufWriter::new(File::create(&path)?));
        let file = begin().map_err(Error::io(&path))?;
        Ok(Self { path, options: options.clone(), file: Some(file), message: Vec::new() })
    }

    /// The file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Writes a frame with its pose, and its detections unless no detector has run. Readers interpolate poses
    /// between frames, so frames must be written in the order of their times.
    ///
    /// # Errors
    ///
    /// [`Error::Unwritable`] for times before 0 or after 2038, and for images that the encoders refuse;
    /// [`Error::Io`].
    pub fn write_frame(
        &mut self,
        frame: &Frame,
        detections: Option<&[Detection]>,
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        let header = self.header(frame.timestamp(), CAMERA)?;
        // Both images are encoded before anything is written: when one fails, nothing of the frame is in the
        // file.
        let unencodable = |error: image::ImageError| self.unwritable(format!("an image: {error}"));
        let depth = depth_picture(frame.depth(), self.options.depth).map_err(unencodable)?;
        let McapWriterOptions { color, jpeg_quality, .. } = self.options;
        let color = frame.color().map(|image| color_picture(image, color, jpeg_quality)).transpose();
        let color = color.map_err(unencodable)?.flatten();
        let info = camera_info(&header, frame.camera());
        self.send(
            "/tf",
            "tf2_msgs/TFMessage",
            &header,
            &camera_transform(&header, WORLD, world_from_camera),
        )?;
        // One camera took both images, and Rerun refuses a second one in the same tf frame.
        let topic = if color.is_some() { "/camera/color/camera_info" } else { "/camera/depth/camera_info" };
        self.send(topic, "sensor_msgs/CameraInfo", &header, &info)?;
        if let Some((format, data)) = color {
            let image = CompressedImage { header: header.clone(), format: format.to_owned(), data: &data };
            self.send("/camera/color/image_raw/compressed", "sensor_msgs/CompressedImage", &header, &image)?;
        }
        if let Some(picture) = depth {
            self.send_depth(&header, frame.depth(), picture)?;
        }
        match detections {
            Some(found) => {
                let array = detection_array(&header, found);
                self.send("/detections", "vision_msgs/Detection2DArray", &header, &array)
            }
            None => Ok(()),
        }
    }

    fn send_depth(
        &mut self,
        header: &Header,
        depth: &DepthImage,
        picture: DepthPicture,
    ) -> Result<(), Error> {
        let topic = "/camera/depth/image_raw";
        match picture {
            DepthPicture::Raw { encoding, step, data } => {
                let image = Image {
                    header: header.clone(),
                    height: depth.height() as u32,
                    width: depth.width() as u32,
                    encoding: encoding.to_owned(),
                    is_bigendian: 0,
                    step,
                    data: &data,
                };
                self.send(topic, "sensor_msgs/Image", header, &image)
            }
            DepthPicture::Packed { format, data } => {
                let image =
                    CompressedImage { header: header.clone(), format: format.to_owned(), data: &data };
                let topic = format!("{topic}/compressedDepth");
                self.send(&topic, "sensor_msgs/CompressedImage", header, &image)
            }
        }
    }

    /// Writes a cloud in world coordinates. It replaces the previous cloud on its topic.
    ///
    /// # Errors
    ///
    /// [`Error::Unwritable`] for a time out of range or more than 4 GB of points; [`Error::Io`].
    pub fn write_cloud(&mut self, topic: &str, time: f64, cloud: &PointCloud) -> Result<(), Error> {
        let header = self.header(time, WORLD)?;
        let PointBytes { fields, step, data } = PointBytes::of(cloud);
        let row_step = u32::try_from(data.len());
        let row_step = row_step.map_err(|_| self.unwritable(format!("{} points on {topic}", cloud.len())))?;
        let message = PointCloud2 {
            header: header.clone(),
            height: 1,
            width: row_step / step,
            fields,
            is_bigendian: false,
            point_step: step,
            row_step,
            data: &data,
            is_dense: true,
        };
        self.send(topic, "sensor_msgs/PointCloud2", &header, &message)
    }

    /// Writes planes that are new or have changed, and the ids of those that no longer exist.
    ///
    /// # Errors
    ///
    /// [`Error::Unwritable`] for a time out of range; [`Error::Io`].
    pub fn write_planes(&mut self, time: f64, planes: &[PlaneRecord], gone: &[u64]) -> Result<(), Error> {
        let header = self.header(time, WORLD)?;
        let update = SceneUpdate {
            deletions: gone.iter().map(|&id| deletion(id, header.stamp)).collect(),
            entities: planes.iter().map(|plane| plane_entity(plane, header.stamp, WORLD)).collect(),
        };
        self.send("/map/planes", "foxglove_msgs/SceneUpdate", &header, &update)
    }

    /// Writes objects that are new or have changed, with labels above them, and the ids of those that no
    /// longer exist. `up` is a unit vector.
    ///
    /// # Errors
    ///
    /// [`Error::Unwritable`] for a time out of range; [`Error::Io`].
    pub fn write_objects(
        &mut self,
        time: f64,
        objects: &[ObjectRecord],
        gone: &[u64],
        up: [f64; 3],
    ) -> Result<(), Error> {
        let header = self.header(time, WORLD)?;
        let entity = |object: &ObjectRecord| object_entity(object, up, header.stamp, WORLD);
        let update = SceneUpdate {
            deletions: gone.iter().map(|&id| deletion(id, header.stamp)).collect(),
            entities: objects.iter().filter_map(entity).collect(),
        };
        self.send("/map/objects", "foxglove_msgs/SceneUpdate", &header, &update)
    }

    /// Writes a grid, which replaces the previous one.
    ///
    /// # Errors
    ///
    /// [`Error::Unwritable`] for a time out of range, and when the number of cells is not width times height;
    /// [`Error::Io`].
    pub fn write_grid(&mut self, time: f64, grid: &GridRecord) -> Result<(), Error> {
        let header = self.header(time, WORLD)?;
        let size = u32::try_from(grid.width).ok().zip(u32::try_from(grid.height).ok());
        let size = size.filter(|_| grid.width.checked_mul(grid.height) == Some(grid.cells.len()));
        let Some((width, height)) = size else {
            let (cells, width, height) = (grid.cells.len(), grid.width, grid.height);
            return Err(self.unwritable(format!("{cells} cells as a grid of {width}x{height}")));
        };
        let data: Vec<u8> = grid.cells.iter().map(|cell| cell.cast_unsigned()).collect();
        let info = MapMetaData {
            map_load_time: header.stamp,
            resolution: grid.resolution as f32,
            width,
            height,
            origin: transform(&grid.world_from_grid),
        };
        let message = OccupancyGrid { header: header.clone(), info, data: &data };
        self.send("/map/grid", "nav_msgs/OccupancyGrid", &header, &message)
    }

    /// Writes all pending messages: everything up to here can be read from now on, and no crash loses it.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn flush(&mut self) -> Result<(), Error> {
        self.with_file(Container::flush)
    }

    /// Completes the file.
    ///
    /// # Errors
    ///
    /// [`Error::Io`].
    pub fn finish(mut self) -> Result<(), Error> {
        self.complete()
    }

    fn complete(&mut self) -> Result<(), Error> {
        self.with_file(Container::finish)?;
        self.file = None;
        Ok(())
    }

    fn with_file<T>(
        &mut self,
        act: impl FnOnce(&mut Container<BufWriter<File>>) -> io::Result<T>,
    ) -> Result<T, Error> {
        let finished = || Err(io::Error::other("the file is finished"));
        self.file.as_mut().map_or_else(finished, act).map_err(Error::io(&self.path))
    }

    fn header(&self, time: f64, frame: &str) -> Result<Header, Error> {
        let stamp = Time::of(time).ok_or_else(|| self.unwritable(format!("the time {time} s")))?;
        Ok(Header { stamp, frame_id: frame.to_owned() })
    }

    fn unwritable(&self, reason: String) -> Error {
        Error::Unwritable { path: self.path.clone(), reason }
    }

    fn send(
        &mut self,
        topic: &str,
        kind: &'static str,
        header: &Header,
        message: &impl Serialize,
    ) -> Result<(), Error> {
        let mut bytes = std::mem::take(&mut self.message);
        let encoded =
            encode(message, &mut bytes).map_err(|reason| self.unwritable(format!("{kind}: {reason}")));
        let time = header.stamp.nanoseconds();
        let sent = encoded.and_then(|()| self.with_file(|file| file.message(topic, kind, time, &bytes)));
        self.message = bytes;
        sent
    }
}

impl Drop for McapWriter {
    /// Completes the file if possible.
    fn drop(&mut self) {
        if self.file.is_some() {
            // There is nobody to report an error to.
            self.complete().ok();
        }
    }
}
