//! The maps of a real kitchen, from the recordings of the data folder.
use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Mutex;

use dymlm::core::{Detection, PlaneId};
use dymlm::objects::MapObject;
use dymlm::planes::PlaneMap;
use dymlm::{MapBuilder, MapConfig};
use dymlm_examples::FrameSource;
use dymlm_io::TumOptions;
use dymlm_test_support::recording;

/// The planes and objects of every second frame.
pub(crate) struct Kitchen {
    pub(crate) planes: PlaneMap,
    pub(crate) objects: Vec<MapObject>,
    /// For each plane of the map, the number of its pixels in all frames, and how many of them show people.
    pixels: BTreeMap<PlaneId, [usize; 2]>,
    /// Pixels of people in all frames.
    pub(crate) people_pixels: usize,
}

impl Kitchen {
    /// The maps of a recording with its detections, made once for all tests. `None` when the recording is not
    /// there.
    pub(crate) fn of(name: &'static str) -> Option<&'static Self> {
        static KITCHENS: Mutex<BTreeMap<&str, Option<&Kitchen>>> = Mutex::new(BTreeMap::new());
        *KITCHENS.lock().unwrap().entry(name).or_insert_with(|| {
            let folder = recording(name)?;
            Some(Box::leak(Box::new(Self::map(&folder, |detections| detections))))
        })
    }

    /// Maps a recording with the detections chosen of each frame's; `None` says that no detector ran.
    pub(crate) fn map(
        folder: &Path,
        choose: impl Fn(Option<Vec<Detection>>) -> Option<Vec<Detection>>,
    ) -> Self {
        let mut options = TumOptions::default();
        options.every = 2;
        let mut source = FrameSource::recorded(folder, None, &options).unwrap();
        let mut config = MapConfig::default();
        // Cloud and octree are not tested, so they may be coarse.
        (config.cloud.voxel_size, config.octree.resolution) = (0.05, 0.2);
        let mut builder = MapBuilder::new(config).unwrap();
        let (mut sightings, mut people_pixels) = (Vec::new(), 0);
        for index in 0..source.len() {
            let mut frame = source.load(index).unwrap();
            let detections = choose(frame.detections.take());
            let report =
                builder.insert(&frame.frame, detections.as_deref(), &frame.world_from_camera).unwrap();
            if let Some(update) = report.update() {
                let people = source.people(index).unwrap().map(|people| people.anybody().unwrap());
                let width = frame.frame.camera().width();
                let shows_people = |pixel: usize| {
                    people.as_ref().is_some_and(|people| people.at(pixel % width, pixel / width))
                };
                people_pixels +=
                    (0..frame.frame.depth().data().len()).filter(|&pixel| shows_people(pixel)).count();
                let counts = count_pixels(&builder, shows_people);
                sightings.extend(update.planes.associations.iter().copied().zip(counts));
            }
            source.recycle(frame);
        }

        let map = builder.into_map();
        let (planes, objects) = (map.planes().clone(), map.objects().objects().cloned().collect());
        let mut pixels: BTreeMap<PlaneId, [usize; 2]> = BTreeMap::new();
        for (id, [all, people]) in sightings {
            // The pixels of merged planes count for the plane that remains; planes that were never confirmed may
            // have been dropped.
            let Some(plane) = planes.plane(id) else { continue };
            let sum = pixels.entry(plane.id()).or_default();
            *sum = [sum[0] + all, sum[1] + people];
        }
        Self { planes, objects, pixels, people_pixels }
    }

    /// The share of each plane's pixels, in all frames, that show people.
    pub(crate) fn people_shares(&self) -> impl Iterator<Item = (PlaneId, f64)> {
        self.pixels.iter().map(|(&id, &[all, people])| (id, people as f64 / all.max(1) as f64))
    }
}

/// For each plane of the last frame, the number of its pixels, and how many of them show people.
fn count_pixels(builder: &MapBuilder, shows_people: impl Fn(usize) -> bool) -> Vec<[usize; 2]> {
    let detector = builder.plane_detector();
    let mut of_label: BTreeMap<u16, [usize; 2]> = BTreeMap::new();
    for (pixel, &label) in detector.labels().iter().enumerate() {
        let [all, people] = of_label.entry(label).or_default();
        *all += 1;
        *people += usize::from(shows_people(pixel));
    }
    detector.planes().iter().map(|plane| of_label[&plane.label]).collect()
}
