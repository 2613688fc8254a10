//! Planes in the boxes of movers: the share that counts, and what a crowd costs.

use std::time::{Duration, Instant};

use crate::common::{camera, room, room_views};
use dymlm_core::{BoundingBox, Frame, SensorModel};
use dymlm_planes::{PlaneDetector, PlaneDetectorConfig, RejectionCause};
use proptest::prelude::*;

fn detector_with(max_mover_overlap: f64) -> PlaneDetector {
    let mut config = PlaneDetectorConfig::default();
    config.max_mover_overlap = max_mover_overlap;
    PlaneDetector::new(&config, &SensorModel::kinect()).unwrap()
}

fn frame() -> Frame {
    room().frame(camera(), &room_views()[0], 1)
}

/// The share of a label's pixels whose centres lie in any of the boxes, counted pixel by pixel.
fn share_in(boxes: &[BoundingBox], labels: &[u16], label: u16) -> f64 {
    let pixels = labels.iter().enumerate().filter(|(_, own)| **own == label).map(|(pixel, _)| pixel);
    let width = camera().width();
    let is_in = |pixel: &usize| {
        let place = [(pixel % width) as f32, (pixel / width) as f32];
        boxes.iter().any(|bounding_box| bounding_box.contains(place))
    };
    pixels.clone().filter(is_in).count() as f64 / pixels.count() as f64
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(16))]
    /// Boxes overlap and leave the image; each pixel counts once.
    #[test]
    fn a_plane_is_rejected_by_its_share_in_the_union_of_the_boxes(
        corners in prop::collection::vec((-40.0..300.0_f32, -40.0..220.0_f32, 1.0..150.0_f32, 1.0..150.0_f32), 1..9),
        limit in 0.0..1.0_f64,
    ) {
        let boxes: Vec<_> =
            corners.iter().map(|&(u, v, w, h)| BoundingBox::new(u, v, u + w, v + h).unwrap()).collect();
        let (frame, mut detector) = (frame(), detector_with(limit));
        // The second time in the buffers of the first.
        for boxes in [&boxes[..], &boxes[1..]] {
            detector.detect(&frame, None, boxes).unwrap();
            let by_movers: Vec<_> = detector
                .rejected()
                .iter()
                .filter_map(|plane| match plane.cause {
                    RejectionCause::Mover { overlap } => Some((plane.label, overlap)),
                    _ => None,
                })
                .collect();
            let most = *detector.labels().iter().max().unwrap();
            let expected: Vec<_> = (1..=most)
                .map(|label| (label, share_in(boxes, detector.labels(), label)))
                .filter(|(_, share)| *share > limit)
                .collect();
            prop_assert_eq!(by_movers, expected);
        }
    }
}

#[test]
fn without_a_limit_no_plane_is_rejected_for_its_movers() {
    let (frame, everything) = (frame(), BoundingBox::new(0.0, 0.0, 1e4, 1e4).unwrap());
    let mut free = detector_with(1.0);
    let planes = free.detect(&frame, None, &[]).unwrap().to_vec();
    assert_eq!(free.detect(&frame, None, &[everything]).unwrap(), planes);
    assert_eq!(detector_with(0.99).detect(&frame, None, &[everything]).unwrap(), []);
}

/// Ten thousand people far away at the left, and a hundred near ones on the right. The time grows with the
/// boxes' number, not with its square: when each pixel of a box was compared with all earlier boxes, this
/// took minutes.
#[test]
fn a_crowd_costs_little() {
    let far = (0..10_000).map(|k| ([(k % 40) as f32, (k / 40 % 200) as f32], [4.0, 8.0]));
    let near = (0..100).map(|k| ([60.0 + (k % 10) as f32, (k / 10) as f32], [240.0, 230.0]));
    let boxes: Vec<_> = far
        .chain(near)
        .map(|([u, v], [width, height])| BoundingBox::new(u, v, u + width, v + height).unwrap())
        .collect();
    let (frame, mut detector) = (frame(), detector_with(0.7));
    let begin = Instant::now();
    detector.detect(&frame, None, &boxes).unwrap();
    assert!(begin.elapsed() < Duration::from_secs(2), "{:?}", begin.elapsed());
}
