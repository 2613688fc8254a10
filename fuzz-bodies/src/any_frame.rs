use dymlm_core::{BoundingBox, ColorImage, DepthImage, Detection, Frame, Mask, PinholeCamera};

use crate::choices::Choices;

const SIDES: [usize; 2] = [32, 24];
const LABELS: [&str; 5] = ["person", "chair", "dog", "cup", "???"];

/// A frame with a wall, a floor, things before them, and readings of any value.
pub(crate) fn frame(choices: &mut Choices<'_>, time: f64) -> Option<Frame> {
    let [width, height] = SIDES;
    let camera = PinholeCamera::new(width, height, 26.0, 26.0, 15.5, 11.5).unwrap();
    let wall = 1.0 + f32::from(choices.below(40)) / 10.0;
    let mut depth: Vec<f32> = (0..width * height)
        .map(|i| {
            let down = ((i / width) as f32 - 11.5) / 26.0;
            if down > 0.0 { wall.min(1.2 / down) } else { wall }
        })
        .collect();
    for _ in 0..choices.below(4) {
        let (left, top, z) =
            (usize::from(choices.below(32)), usize::from(choices.below(24)), choices.number() as f32);
        let (right, bottom) = (left + usize::from(choices.below(16)), top + usize::from(choices.below(16)));
        for v in top..bottom.min(height) {
            depth[v * width..][left..right.min(width).max(left)].fill(z);
        }
    }
    let colors = choices.is_true().then(|| {
        let shade = choices.byte();
        ColorImage::new(width, height, (0..width * height).map(|i| [shade, i as u8, 90]).collect()).unwrap()
    });
    Frame::new(time, camera, DepthImage::new(width, height, depth).ok()?, colors).ok()
}

/// Detections for a frame: mostly a few boxes, seldom very many.
pub(crate) fn detections(choices: &mut Choices<'_>) -> Vec<Detection> {
    let count = if choices.byte() > 252 { 400 } else { usize::from(choices.below(5)) };
    (0..count).filter_map(|_| detection(choices)).collect()
}

fn detection(choices: &mut Choices<'_>) -> Option<Detection> {
    let label = LABELS[usize::from(choices.below(5))];
    let score = f32::from(choices.byte()) / 255.0;
    let bounding_box = if choices.byte() < 220 {
        let [x, y] = [0; 2].map(|_| f32::from(choices.below(40)) - 4.0);
        let [w, h] = [0; 2].map(|_| f32::from(choices.below(30)));
        BoundingBox::new(x, y, x + w, y + h)
    } else {
        let [a, b, c, d] = choices.numbers().map(|c: f64| c as f32);
        BoundingBox::new(a, b, c, d)
    };
    let detection = Detection::new(label, score, bounding_box.ok()?).ok()?;
    if choices.byte() < 200 {
        return Some(detection);
    }
    let [width, height] = if choices.byte() < 250 { SIDES } else { [3, 5] };
    let shift = usize::from(choices.byte());
    let mask = Mask::from_fn(width, height, |u, v| (u * 7 + v * 3 + shift) % 11 < 5).ok()?;
    Some(detection.with_mask(mask))
}
