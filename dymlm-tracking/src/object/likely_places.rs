use dymlm_core::{BoundingBox, Detection, Pose};

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
    /// Boxes of the object's label (any label, when it has none), best score first, then `others`.
    pub(super) fn places(
        &self,
        scene: Scene<'_>,
        detections: &[Detection],
        others: &[BoundingBox],
    ) -> Vec<Place> {
        let mut boxes: Vec<(f32, BoundingBox)> = detections
            .iter()
            .filter(|detection| self.label.is_none_or(|label| label == detection.label()))
            .map(|detection| (detection.score(), detection.bounding_box()))
            .collect();
        boxes.sort_by(|a, b| b.0.total_cmp(&a.0));
        let detected = boxes.iter().filter_map(|&(_, region)| self.place(scene, region));
        let others = others.iter().filter_map(|&region| self.place(scene, region));
        detected.chain(others).take(MOST_PLACES).collect()
    }

    /// The place shown by the middle of the box's part on the image.
    fn place(&self, scene: Scene<'_>, region: BoundingBox) -> Option<Place> {
        let camera = scene.camera;
        let region = region.clipped(camera.width(), camera.height())?;
        let expected = self.model.bounds_in_image(camera, &self.camera_from_object)?;
        let [width, height] = [region.width(), region.height()].map(|side| 0.25 * side);
        let [u, v] = region.center();
        let middle = BoundingBox::new(u - width, v - height, u + width, v + height).ok()?;
        let last = self.camera_from_object.translation()[2];
        let depth = match median_depth(scene, middle) {
            // The origin is assumed to lie a quarter of the object's longest side behind its surface.
            Some(surface) => surface + 0.5 * self.model.reach(),
            None => last * f64::from((expected.area() / region.area().max(1.0)).sqrt()),
        };
        let center = [u - 0.5, v - 0.5];
        (depth.is_finite() && depth > 0.0).then_some(Place { center, depth })
    }
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
