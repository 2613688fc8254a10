use dymlm_core::{BoundingBox, Detection, PinholeCamera, Pose};

use super::model::ObjectModel;
use super::scene::Scene;

/// Largest number of places tried in one frame.
const MOST_PLACES: usize = 2;

/// A place where a lost object may be: the middle of a box in the image, and a depth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) center: [f32; 2],
    /// Depth of the object's origin, metres.
    pub(super) depth: f64,
}

/// What is known about a lost object.
pub(super) struct Wanted<'a> {
    pub(super) model: &'a ObjectModel,
    pub(super) label: Option<&'a str>,
    /// The last pose, or a prediction from it.
    pub(super) camera_from_object: Pose,
}

impl Wanted<'_> {
    /// Where to look in one frame: in boxes of the object's label (any label, when it has none) and in
    /// `others`. Where these are too many, each has its turn; `turn`: number of frames searched before. Other
    /// things of the label never keep the search from the object's last place.
    pub(super) fn places(
        &self,
        scene: Scene<'_>,
        detections: &[Detection],
        others: &[BoundingBox],
        turn: usize,
    ) -> Vec<Place> {
        let mut boxes: Vec<(f32, BoundingBox)> = detections
            .iter()
            .filter(|detection| self.label.is_none_or(|label| label == detection.label()))
            .map(|detection| (detection.score(), detection.bounding_box()))
            .collect();
        // The detector's order does not matter.
        let corners = |region: BoundingBox| <[f32; 4]>::from(region).map(f32::to_bits);
        boxes.sort_by(|a, b| b.0.total_cmp(&a.0).then(corners(a.1).cmp(&corners(b.1))));
        let detected: Vec<Place> =
            boxes.iter().filter_map(|&(_, region)| self.place(scene, region)).collect();
        let others: Vec<Place> = others.iter().filter_map(|&region| self.place(scene, region)).collect();
        let are_both = !detected.is_empty() && !others.is_empty();
        let count = if are_both { MOST_PLACES / 2 } else { MOST_PLACES };
        [detected, others].iter().flat_map(|places| in_turn(places, count, turn)).collect()
    }

    /// The place shown by the middle of the box's part on the image.
    fn place(&self, scene: Scene<'_>, region: BoundingBox) -> Option<Place> {
        let camera = scene.camera;
        let region = region.clipped(camera.width(), camera.height())?;
        let [width, height] = [region.width(), region.height()].map(|side| 0.25 * side);
        let [u, v] = region.center();
        let middle = BoundingBox::new(u - width, v - height, u + width, v + height).ok()?;
        let depth = match median_depth(scene, middle) {
            // The origin is assumed to lie a quarter of the object's longest side behind its surface.
            Some(surface) => surface + 0.5 * self.model.reach(),
            None => self.depth_by_size(camera, region)?,
        };
        let center = [u - 0.5, v - 0.5];
        (depth.is_finite() && depth > 0.0).then_some(Place { center, depth })
    }
}

impl Wanted<'_> {
    /// The depth at which the object would fill a box as large as this one; `None` as long as the last pose,
    /// from which its size in the image is known, is behind the camera.
    fn depth_by_size(&self, camera: &PinholeCamera, region: BoundingBox) -> Option<f64> {
        let expected = self.model.bounds_in_image(camera, &self.camera_from_object)?;
        let last = self.camera_from_object.translation()[2];
        Some(last * f64::from((expected.area() / region.area().max(1.0)).sqrt()))
    }
}

/// So many of some places, or all: those that follow the ones of the turn before.
fn in_turn(places: &[Place], count: usize, turn: usize) -> impl Iterator<Item = Place> {
    let first = turn.wrapping_mul(count).checked_rem(places.len()).unwrap_or(0);
    places.iter().cycle().skip(first).take(count.min(places.len())).copied()
}

fn median_depth(scene: Scene<'_>, region: BoundingBox) -> Option<f64> {
    let depth = scene.depth;
    let columns = region.columns(depth.width());
    let mut readings: Vec<f32> = region
        .rows(depth.height())
        .flat_map(|v| depth.row(v).get(columns.clone()).unwrap_or(&[]))
        .copied()
        .filter(|&reading| scene.sensor.is_used(reading))
        .collect();
    if readings.is_empty() {
        return None;
    }
    let middle = readings.len() / 2;
    let (_, &mut median, _) = readings.select_nth_unstable_by(middle, f32::total_cmp);
    Some(median.into())
}

#[cfg(test)]
mod tests {
    use dymlm_core::{DepthImage, SensorModel};

    use super::*;
    use crate::{GrayImage, ImagePyramid};

    #[test]
    fn a_detected_box_is_a_place_though_the_last_pose_is_behind_the_camera() {
        let camera = PinholeCamera::new(64, 48, 60.0, 60.0, 31.5, 23.5).unwrap();
        let pyramid = ImagePyramid::new(&GrayImage::new(64, 48, vec![0.5; 64 * 48]).unwrap(), 0);
        let [depth, unread] = [1.5, 0.0].map(|z| DepthImage::new(64, 48, vec![z; 64 * 48]).unwrap());
        let (model, sensor) = (ObjectModel::cuboid([0.2, 0.1, 0.1]).unwrap(), SensorModel::kinect());
        let places = |depth: &DepthImage, z: f64| {
            let camera_from_object = Pose::new([0.0, 0.0, z], [0.0, 0.0, 0.0, 1.0]).unwrap();
            let wanted = Wanted { model: &model, label: Some("book"), camera_from_object };
            let found = Detection::new("book", 0.9, BoundingBox::new(20.0, 10.0, 40.0, 30.0).unwrap());
            let scene = Scene { camera: &camera, pyramid: &pyramid, depth, sensor: &sensor };
            wanted.places(scene, &[found.unwrap()], &[], 0)
        };
        let expected = Place { center: [29.5, 19.5], depth: 1.5 + 0.5 * model.reach() };
        assert_eq!(places(&depth, 2.0), [expected]);
        assert_eq!(places(&depth, -2.0), [expected]);
        // Without readings only the size in the image tells how far away it is.
        assert_eq!([places(&unread, 2.0).len(), places(&unread, -2.0).len()], [1, 0]);
    }

    /// Regression: two other books were looked at in each frame, and the last place never; and of three that
    /// were alike, the list's order decided.
    #[test]
    fn each_place_has_its_turn_whatever_the_order_of_detections() {
        let camera = PinholeCamera::new(640, 480, 500.0, 500.0, 319.5, 239.5).unwrap();
        let pyramid = ImagePyramid::new(&GrayImage::new(640, 480, vec![0.5; 640 * 480]).unwrap(), 0);
        let depth = DepthImage::new(640, 480, vec![1.5; 640 * 480]).unwrap();
        let (model, sensor) = (ObjectModel::cuboid([0.2, 0.1, 0.1]).unwrap(), SensorModel::kinect());
        let scene = Scene { camera: &camera, pyramid: &pyramid, depth: &depth, sensor: &sensor };
        let wanted = Wanted { model: &model, label: None, camera_from_object: Pose::identity() };
        let at = |left: f32| BoundingBox::new(left, 10.0, left + 40.0, 50.0).unwrap();
        let book = |left: f32| Detection::new("book", 0.9, at(left)).unwrap();
        let in_turns = |lefts: &[f32], others: &[BoundingBox]| -> Vec<Vec<f32>> {
            let found: Vec<Detection> = lefts.iter().copied().map(book).collect();
            let places = (0..6).map(|turn| wanted.places(scene, &found, others, turn));
            places.map(|places| places.iter().map(|place| place.center[0] - 19.5).collect()).collect()
        };
        let others = [at(400.0), at(500.0)];
        let turns = in_turns(&[0.0, 100.0, 200.0], &others);
        assert_eq!(turns[..3], [[0.0, 400.0], [100.0, 500.0], [200.0, 400.0]]);
        assert_eq!(in_turns(&[200.0, 0.0, 100.0], &others), turns);
        // Where there is only one kind, it has both places.
        assert_eq!(in_turns(&[], &others)[1], [400.0, 500.0]);
        assert_eq!(in_turns(&[0.0, 100.0, 200.0], &[])[1], [200.0, 0.0]);
        assert_eq!(in_turns(&[], &[])[5], [0.0; 0]);
    }
}
