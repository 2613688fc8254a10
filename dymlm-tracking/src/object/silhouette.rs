use std::ops::Range;

use dymlm_core::{PinholeCamera, Pose};

use super::model::ObjectModel;
use crate::GrayImage;

/// The pixels of a part of the image that show a model at a pose: 1 where they do, else 0. A rim of one
/// pixel, whose gradients are those of the outline, counts as outside.
///
/// The model's points are drawn as squares as large as the distance between points. What the squares add at
/// the outline is removed by erosion (a morphological closing). O(pixels x size of the squares).
pub(super) fn silhouette(
    model: &ObjectModel,
    camera: &PinholeCamera,
    camera_from_object: &Pose,
    columns: &Range<usize>,
    rows: &Range<usize>,
) -> Option<GrayImage> {
    let (width, height) = (columns.len(), rows.len());
    let mut covered = vec![0.0_f32; width * height];
    let focal = camera.fx().abs().max(camera.fy().abs());
    let distance = camera_from_object.translation()[2];
    let reach = (model.spacing() * focal / distance).ceil();
    // So near that the points are a window apart, the outline is not defined.
    if !(reach >= 1.0 && reach <= MOST_REACH as f64) {
        return None;
    }
    let reach = reach as usize;
    for point in model.surface() {
        let Some([u, v]) = camera.project(camera_from_object.transform_point(point.position)) else {
            continue;
        };
        let span = |center: f64, first: usize, count: usize| {
            let begin = (center.round() - (first + reach) as f64).clamp(0.0, count as f64) as usize;
            let end = (center.round() - first as f64 + (reach + 1) as f64).clamp(0.0, count as f64) as usize;
            begin..end.max(begin)
        };
        let across = span(u, columns.start, width);
        for y in span(v, rows.start, height) {
            covered[y * width..][across.clone()].fill(1.0);
        }
    }
    erode(&mut covered, width, height, reach + 1);
    GrayImage::new(width, height, covered).ok()
}

/// Largest half side of a square, pixels.
const MOST_REACH: usize = 30;

/// The least value within `reach` pixels along rows, then along columns; pixels outside the border are
/// ignored.
fn erode(values: &mut [f32], width: usize, height: usize, reach: usize) {
    let mut line = Vec::new();
    let mut run = |first: usize, step: usize, count: usize| {
        line.clear();
        line.extend((0..count).map(|i| values[first + i * step]));
        for i in 0..count {
            let near = &line[i.saturating_sub(reach)..(i + reach + 1).min(count)];
            values[first + i * step] = near.iter().copied().fold(1.0, f32::min);
        }
    };
    (0..height).for_each(|y| run(y * width, 1, width));
    (0..width).for_each(|x| run(x, width, height));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fills_the_outline_less_its_rim() {
        let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5).unwrap();
        let model = ObjectModel::cuboid([0.4, 0.2, 0.02]).unwrap();
        let pose = Pose::new([0.1, 0.0, 1.01], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let mask = silhouette(&model, &camera, &pose, &(10..150), &(5..115)).unwrap();
        // The face at 1 m: 52 x 26 pixels around (92.5, 59.5).
        for (v, u) in (0..110).flat_map(|v| (0..140).map(move |u| (v, u))) {
            let [across, down] = [(u as f64 + 10.0 - 92.5).abs(), (v as f64 + 5.0 - 59.5).abs()];
            if across < 23.0 && down < 10.0 {
                assert_eq!(mask.at(u, v), 1.0, "{u} {v}");
            }
            if across > 26.0 || down > 13.0 {
                assert_eq!(mask.at(u, v), 0.0, "{u} {v}");
            }
        }
    }

    #[test]
    fn too_near_to_have_an_outline() {
        let camera = PinholeCamera::new(160, 120, 130.0, 130.0, 79.5, 59.5).unwrap();
        let model = ObjectModel::cuboid([0.4, 0.2, 0.02]).unwrap();
        for z in [-1.0, 0.0, 0.02] {
            let pose = Pose::new([0.0, 0.0, z], [0.0, 0.0, 0.0, 1.0]).unwrap();
            assert!(silhouette(&model, &camera, &pose, &(0..160), &(0..120)).is_none());
        }
    }
}
