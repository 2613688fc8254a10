use std::fs;
use std::path::{Path, PathBuf};

use dymlm_core::{Detection, Frame, PinholeCamera, Pose};
use serde_json::json;

use crate::image_file::{write_depth_png, write_png};
use crate::text_lines::number;
use crate::{Error, StampedPose, Trajectory, write_atomically, write_detections};

/// Writes a sequence as a TUM RGB-D folder, which [`TumDataset`](crate::TumDataset) and other systems read.
///
/// Images are written at once. [`Self::finish`] writes the lists, the trajectory and the detections, so that
/// an interrupted folder is not mistaken for a complete dataset. Either all frames have colour or none: a
/// reader of `associations.txt`, or of a `rgb.txt` beside `depth.txt`, takes no depth image without a colour
/// image, so that the format has no place for frames without colour among others.
///
/// ```
/// use dymlm_core::{DepthImage, Frame, PinholeCamera, Pose};
/// use dymlm_io::{TumDataset, TumOptions, TumWriter};
///
/// # let folder = tempfile::tempdir()?;
/// # let folder = folder.path().join("sequence");
/// let camera = PinholeCamera::new(64, 48, 60.0, 60.0, 31.5, 23.5)?;
/// let mut writer = TumWriter::create(&folder, &camera)?;
/// let frame = Frame::new(0.1, camera, DepthImage::new(64, 48, vec![2.0; 64 * 48])?, None)?;
/// writer.write(&frame, &[], &Pose::identity())?;
/// writer.finish()?;
///
/// let dataset = TumDataset::open(&folder, &TumOptions::default())?;
/// assert_eq!(dataset.load(0)?.frame, frame);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Debug)]
pub struct TumWriter {
    folder: PathBuf,
    camera: PinholeCamera,
    frames: Vec<WrittenFrame>,
}

#[derive(Debug)]
struct WrittenFrame {
    /// Name of the frame's images, without folder and extension: the time in seconds with six decimals.
    name: String,
    timestamp: f64,
    has_color: bool,
    world_from_camera: Pose,
    detections: Vec<Detection>,
}

/// Stored depth units in a metre, as in the benchmark's own PNGs: depth up to 13.1 m in steps of 0.2 mm.
const DEPTH_SCALE: f64 = 5000.0;

impl TumWriter {
    /// Begins a dataset in a folder that is empty or does not exist yet.
    ///
    /// # Errors
    ///
    /// [`Error::InTheWay`] when the folder is not empty; [`Error::Io`] when it cannot be created.
    pub fn create(folder: impl AsRef<Path>, camera: &PinholeCamera) -> Result<Self, Error> {
        let folder = folder.as_ref().to_path_buf();
        fs::create_dir_all(&folder).map_err(Error::io(&folder))?;
        if fs::read_dir(&folder).map_err(Error::io(&folder))?.next().is_some() {
            return Err(Error::InTheWay { path: folder });
        }
        for images in ["rgb", "depth"] {
            let path = folder.join(images);
            fs::create_dir(&path).map_err(Error::io(&path))?;
        }
        let writer = Self { folder, camera: *camera, frames: Vec::new() };
        writer.write_camera()?;
        Ok(writer)
    }

    /// Writes a frame's images and keeps its detections and pose for the lists. Depth is
    /// stored in steps of 0.2 mm up to 13.1 m.
    ///
    /// # Errors
    ///
    /// [`Error::Malformed`] when the frame has another camera than the dataset, when it has colour and the
    /// frames before it have none or the reverse, and when it is not later than the previous frame in whole
    /// microseconds, to which times are rounded in the lists and the names of the images; else as
    /// [`write_depth_png`]. The dataset stays as it was.
    pub fn write(
        &mut self,
        frame: &Frame,
        detections: &[Detection],
        world_from_camera: &Pose,
    ) -> Result<(), Error> {
        let timestamp = frame.timestamp();
        let name = format!("{timestamp:.6}");
        self.check(frame, &name).map_err(|reason| Error::malformed(&self.folder, reason))?;
        write_depth_png(self.image("depth", &name), frame.depth(), DEPTH_SCALE)?;
        if let Some(color) = frame.color() {
            write_png(self.image("rgb", &name), color.width(), color.height(), color.data())?;
        }
        self.frames.push(WrittenFrame {
            name,
            timestamp,
            has_color: frame.color().is_some(),
            world_from_camera: *world_from_camera,
            detections: detections.to_vec(),
        });
        Ok(())
    }

    /// Writes the lists, the trajectory and the detections.
    ///
    /// # Errors
    ///
    /// As [`write_atomically`].
    pub fn finish(self) -> Result<(), Error> {
        self.write_trajectory()?;
        let detections = self.frames.iter().map(|frame| (frame.timestamp, frame.detections.as_slice()));
        write_detections(self.folder.join("detections.jsonl"), detections)?;
        if self.has_color() {
            self.write_list("rgb")?;
            self.write_associations()?;
        }
        self.write_list("depth")
    }

    /// Whether a frame belongs after those written so far, or why not.
    fn check(&self, frame: &Frame, name: &str) -> Result<(), String> {
        let timestamp = frame.timestamp();
        if *frame.camera() != self.camera {
            return Err(format!("the frame of {timestamp} s was taken with another camera"));
        }
        let Some(last) = self.frames.last() else { return Ok(()) };
        match (last.has_color, frame.color().is_some()) {
            (true, false) => Err(format!("the frame of {timestamp} s has no colour, but those before it do")),
            (false, true) => {
                Err(format!("the frame of {timestamp} s has colour, but those before it do not"))
            }
            // The times that readers find: two times may be apart and have one name.
            _ if number(name)? <= number(&last.name)? => {
                Err(format!("a frame of {timestamp} s after one of {} s", last.timestamp))
            }
            _ => Ok(()),
        }
    }

    /// Whether the frames have colour: all or none.
    fn has_color(&self) -> bool {
        self.frames.last().is_some_and(|frame| frame.has_color)
    }

    fn image(&self, folder: &str, name: &str) -> PathBuf {
        self.folder.join(folder).join(format!("{name}.png"))
    }

    fn write_camera(&self) -> Result<(), Error> {
        let camera = &self.camera;
        let value = json!({
            "width": camera.width(), "height": camera.height(),
            "fx": camera.fx(), "fy": camera.fy(), "cx": camera.cx(), "cy": camera.cy(),
            "depth_scale": DEPTH_SCALE,
        });
        write_atomically(self.folder.join("camera.json"), |out| writeln!(out, "{value:#}"))
    }

    fn write_trajectory(&self) -> Result<(), Error> {
        let poses = self.frames.iter().map(|frame| StampedPose {
            timestamp: frame.timestamp,
            world_from_camera: frame.world_from_camera,
        });
        let path = self.folder.join("groundtruth.txt");
        let trajectory = Trajectory::new(poses.collect());
        trajectory.map_err(|error| Error::malformed(&path, error.to_string()))?.write(&path)
    }

    fn write_list(&self, images: &str) -> Result<(), Error> {
        write_atomically(self.folder.join(format!("{images}.txt")), |out| {
            writeln!(out, "# timestamp filename")?;
            self.names().try_for_each(|name| writeln!(out, "{name} {images}/{name}.png"))
        })
    }

    fn write_associations(&self) -> Result<(), Error> {
        write_atomically(self.folder.join("associations.txt"), |out| {
            self.names().try_for_each(|name| writeln!(out, "{name} rgb/{name}.png {name} depth/{name}.png"))
        })
    }

    fn names(&self) -> impl Iterator<Item = &str> {
        self.frames.iter().map(|frame| frame.name.as_str())
    }
}
