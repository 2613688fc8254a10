use dymlm_core::{BoundingBox, ColorImage, DepthImage, Detection, PinholeCamera, Pose};

use super::ObjectModel;
use super::view::projected_bounds;

/// Bins a channel of a colour histogram.
const BINS: usize = 4;
/// Places tried in one frame.
const MOST_PLACES: usize = 2;
/// Least likeness of colours, Bhattacharyya coefficient.
const LEAST_LIKENESS: f64 = 0.55;

/// How the object is coloured: a histogram of 4x4x4 colours.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Appearance {
    share: Vec<f64>,
}

impl Appearance {
    /// Of the pixels in a box that `chosen` says belong to the object; `None` when there are none.
    pub(super) fn of(
        color: &ColorImage,
        region: BoundingBox,
        chosen: impl Fn(usize, usize) -> bool,
    ) -> Option<Self> {
        let mut share = vec![0.0; BINS * BINS * BINS];
        let mut count = 0.0;
        for v in region.rows(color.height()) {
            for u in region.columns(color.width()).filter(|&u| chosen(u, v)) {
                let bin = color.at(u, v)?.iter().fold(0, |bin, &c| bin * BINS + usize::from(c) * BINS / 256);
                share[bin] += 1.0;
                count += 1.0;
            }
        }
        for s in &mut share {
            *s /= count;
        }
        (count > 0.0).then_some(Self { share })
    }

    /// Bhattacharyya coefficient, 0..=1.
    pub(super) fn likeness(&self, other: &Self) -> f64 {
        self.share.iter().zip(&other.share).map(|(a, b)| (a * b).sqrt()).sum()
    }
}

/// Where a lost object may be: the middle of a box in the image, and how far away.
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
    pub(super) appearance: Option<&'a Appearance>,
    /// The last pose, or where it may have gone since.
    pub(super) camera_from_object: Pose,
}

impl Wanted<'_> {
    /// Boxes of the object's label (any label, when it has none) that have its size and colour, best score first, then
    /// `others`.
    pub(super) fn places(
        &self,
        camera: &PinholeCamera,
        color: &ColorImage,
        depth: &DepthImage,
        detections: &[Detection],
        others: &[BoundingBox],
    ) -> Vec<Place> {
        let mut boxes: Vec<(f32, BoundingBox)> = detections
            .iter()
            .filter(|detection| self.label.is_none_or(|label| label == detection.label()))
            .map(|detection| (detection.score(), detection.bounding_box()))
            .collect();
        boxes.sort_by(|a, b| b.0.total_cmp(&a.0));
        let detected = boxes
            .iter()
            .filter_map(|&(_, region)| self.place(camera, depth, region))
            .filter(|(region, place)| self.has_size(camera, *region, place.depth))
            .filter(|(region, _)| self.has_color(color, *region))
            .map(|(_, place)| place);
        let others = others.iter().filter_map(|&region| Some(self.place(camera, depth, region)?.1));
        detected.chain(others).take(MOST_PLACES).collect()
    }

    /// The box's part on the image, and the place that its middle shows.
    fn place(
        &self,
        camera: &PinholeCamera,
        depth: &DepthImage,
        region: BoundingBox,
    ) -> Option<(BoundingBox, Place)> {
        let region = region.clipped(camera.width(), camera.height())?;
        let expected = projected_bounds(self.model, camera, &self.camera_from_object)?;
        let [width, height] = [region.width(), region.height()].map(|side| 0.25 * side);
        let [u, v] = region.center();
        let middle = BoundingBox::new(u - width, v - height, u + width, v + height).ok()?;
        let last = self.camera_from_object.translation()[2];
        let depth = match median_depth(depth, middle) {
            // The surface lies before the origin as it did when last seen.
            Some(surface) => surface + 0.5 * self.model.reach(),
            None => last * f64::from((expected.area() / region.area().max(1.0)).sqrt()),
        };
        let center = [u - 0.5, v - 0.5];
        (depth.is_finite() && depth > 0.0).then_some((region, Place { center, depth }))
    }

    /// Whether a box is as large as some side of the object would be at that depth.
    fn has_size(&self, camera: &PinholeCamera, region: BoundingBox, depth: f64) -> bool {
        let metres = |pixels: f32, focal: f64| f64::from(pixels) * depth / focal.abs();
        let diagonal = metres(region.width(), camera.fx()).hypot(metres(region.height(), camera.fy()));
        let longest = 2.0 * self.model.reach();
        (0.3 * longest..=2.5 * longest).contains(&diagonal)
    }

    fn has_color(&self, color: &ColorImage, region: BoundingBox) -> bool {
        let Some(wanted) = self.appearance else { return true };
        // The middle of a box mostly shows the object.
        let [u, v] = region.center();
        let half = [0.35 * region.width(), 0.35 * region.height()];
        let Ok(middle) = BoundingBox::new(u - half[0], v - half[1], u + half[0], v + half[1]) else {
            return false;
        };
        Appearance::of(color, middle, |_, _| true).is_some_and(|seen| seen.likeness(wanted) >= LEAST_LIKENESS)
    }
}

fn median_depth(depth: &DepthImage, region: BoundingBox) -> Option<f64> {
    let columns = region.columns(depth.width());
    let mut readings: Vec<f32> = region
        .rows(depth.height())
        .flat_map(|v| depth.row(v).get(columns.clone()).unwrap_or(&[]))
        .copied()
        .filter(|&reading| reading > 0.0)
        .collect();
    if readings.is_empty() {
        return None;
    }
    let middle = readings.len() / 2;
    let (_, &mut median, _) = readings.select_nth_unstable_by(middle, f32::total_cmp);
    Some(median.into())
}
