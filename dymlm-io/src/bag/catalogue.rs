use std::collections::{BTreeMap, BTreeSet};

use super::bag_file::{BagEvent, BagFile, Place};
use super::transforms::TransformTree;
use crate::Error;
use crate::ros2::messages::{
    CameraInfo, CompressedImage, HeaderOnly, Image, Odometry, TransformMessage, decode,
};

/// The content of a bag: places of its images and detections in the file, its cameras, and its transforms.
#[derive(Debug, Default)]
pub(super) struct Catalogue {
    pub(super) images: BTreeMap<String, ImageTopic>,
    pub(super) infos: BTreeMap<String, CameraInfo>,
    pub(super) detections: BTreeMap<String, Vec<Listed>>,
    /// By topic, with the times at which they were recorded.
    pub(super) odometry: BTreeMap<String, Vec<(f64, Odometry)>>,
    pub(super) tree: TransformTree,
    /// Faults of the file and of whole topics.
    pub(super) faults: BTreeSet<String>,
    /// Unreadable messages by topic: their number, and what is wrong with the first.
    broken: BTreeMap<String, (usize, String)>,
}

/// A message that is only read when it is needed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Listed {
    /// The time stamp in its header, or the time of recording if it has none, seconds.
    pub(super) timestamp: f64,
    pub(super) place: Place,
}

/// The images of a topic.
#[derive(Debug)]
pub(super) struct ImageTopic {
    pub(super) is_compressed: bool,
    /// Encoding of the first image, or its format if it is compressed.
    pub(super) encoding: String,
    pub(super) frame_id: String,
    pub(super) images: Vec<Listed>,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Image,
    Compressed,
    Info,
    Transforms,
    Odometry,
    Detections,
}

impl Kind {
    fn of(schema: &str) -> Option<Self> {
        // Some writers leave out the middle part, `msg`.
        let (package, name) = (schema.split('/').next()?, schema.rsplit('/').next()?);
        Some(match (package, name) {
            ("sensor_msgs", "Image") => Self::Image,
            ("sensor_msgs", "CompressedImage") => Self::Compressed,
            ("sensor_msgs", "CameraInfo") => Self::Info,
            ("tf2_msgs", "TFMessage") => Self::Transforms,
            ("nav_msgs", "Odometry") => Self::Odometry,
            ("vision_msgs", "Detection2DArray") => Self::Detections,
            _ => return None,
        })
    }
}

impl Catalogue {
    /// Lists the content of a bag in one pass over the file.
    pub(super) fn of(bag: &mut BagFile) -> Result<Self, Error> {
        let mut catalogue = Self::default();
        let mut channels: BTreeMap<u16, (String, Kind)> = BTreeMap::new();
        let mut faults = Vec::new();
        let mut on_event = |event: BagEvent<'_>| match event {
            BagEvent::Channel { id, topic, schema, schema_text, encoding } => {
                match catalogue.readable(topic, schema, schema_text, encoding) {
                    Some(kind) => drop(channels.insert(id, (topic.to_owned(), kind))),
                    None => drop(channels.remove(&id)),
                }
            }
            BagEvent::Message { header, data, place } => {
                let Some((topic, kind)) = channels.get(&header.channel_id) else { return };
                let recorded = header.log_time as f64 / 1e9;
                if let Err(reason) = catalogue.list(topic, *kind, data, recorded, place) {
                    catalogue.broken.entry(topic.clone()).or_insert((0, reason)).0 += 1;
                }
            }
        };
        bag.read_through(&mut on_event, &mut |fault| faults.push(fault))?;
        catalogue.faults.extend(faults);
        for topic in catalogue.images.values_mut() {
            topic.images.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
        }
        for listed in catalogue.detections.values_mut() {
            listed.sort_by(|a, b| a.timestamp.total_cmp(&b.timestamp));
        }
        Ok(catalogue)
    }

    /// One line for each fault that a user should be warned of.
    pub(super) fn warnings(&self) -> Vec<String> {
        let mut warnings: Vec<String> = self.faults.iter().cloned().collect();
        warnings.extend(self.broken.iter().map(|(topic, (count, reason))| {
            format!("{topic}: {count} messages cannot be read, the first: {reason}")
        }));
        warnings.extend(self.tree.second_parents.iter().map(|((child, parent), count)| {
            format!("{count} transforms {parent:?} -> {child:?} are left out: {child:?} has another parent")
        }));
        warnings
    }

    /// The kind of a channel's messages, when they can be read.
    fn readable(&mut self, topic: &str, schema: &str, text: &[u8], encoding: &str) -> Option<Kind> {
        let kind = Kind::of(schema)?;
        if encoding != "cdr" {
            self.faults.insert(format!("{topic} is left out: encoded as {encoding:?}; ROS 2's cdr is read"));
            return None;
        }
        // Up to ROS 2 Foxy, each detection ends with an image, which newer ones do not have.
        let holds = |field: &[u8]| text.windows(field.len()).any(|part| part == field);
        if kind == Kind::Detections && holds(b"source_img") {
            self.faults.insert(format!("{topic} is left out: its vision_msgs is older than version 3"));
            return None;
        }
        Some(kind)
    }

    fn list(
        &mut self,
        topic: &str,
        kind: Kind,
        data: &[u8],
        recorded: f64,
        place: Place,
    ) -> Result<(), String> {
        match kind {
            Kind::Image | Kind::Compressed => {
                let stamp = decode::<HeaderOnly>(data)?.header.stamp;
                if !self.images.contains_key(topic) {
                    let first = ImageTopic::of(kind == Kind::Compressed, data)?;
                    self.images.insert(topic.to_owned(), first);
                }
                let timestamp = stamp.seconds().unwrap_or(recorded);
                if let Some(listed) = self.images.get_mut(topic) {
                    listed.images.push(Listed { timestamp, place });
                }
            }
            Kind::Info => {
                let info: CameraInfo = decode(data)?;
                let first = self.infos.entry(topic.to_owned()).or_insert_with(|| info.clone());
                if first.lens != info.lens {
                    self.faults.insert(format!("{topic} changes; the first camera counts"));
                }
            }
            Kind::Transforms => {
                let is_fixed = topic.ends_with("tf_static");
                self.tree.add_all(&decode::<TransformMessage>(data)?.transforms, is_fixed, Some(recorded))?;
            }
            Kind::Odometry => {
                self.odometry.entry(topic.to_owned()).or_default().push((recorded, decode(data)?));
            }
            Kind::Detections => {
                let stamp = decode::<HeaderOnly>(data)?.header.stamp;
                let timestamp = stamp.seconds().unwrap_or(recorded);
                self.detections.entry(topic.to_owned()).or_default().push(Listed { timestamp, place });
            }
        }
        Ok(())
    }
}

impl ImageTopic {
    fn of(is_compressed: bool, data: &[u8]) -> Result<Self, String> {
        let (header, encoding) = if is_compressed {
            let image: CompressedImage<'_> = decode(data)?;
            (image.header, image.format)
        } else {
            let image: Image<'_> = decode(data)?;
            (image.header, image.encoding)
        };
        Ok(Self { is_compressed, encoding, frame_id: header.frame_id, images: Vec::new() })
    }
}
