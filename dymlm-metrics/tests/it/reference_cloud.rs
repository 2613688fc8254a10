//! The metrics against a stitched reference: by hand, by brute force, and on the recorded kitchen.
use std::collections::{BTreeMap, HashMap};

use dymlm_core::{DepthImage, Detection, Frame, Mask, PinholeCamera, Point, Pose};
use dymlm_metrics::{ReferenceCloud, ReferenceScore};
use dymlm_test_support::{recorded_frames, recording};
use proptest::prelude::*;

/// A frame of one row with the given depths.
fn frame(depths: Vec<f32>) -> Frame {
    let width = depths.len();
    let camera = PinholeCamera::new(width, 1, 100.0, 100.0, 0.0, 0.0).unwrap();
    Frame::new(0.0, camera, DepthImage::new(width, 1, depths).unwrap(), None).unwrap()
}

proptest! {
    /// The formulas word by word: voxels of the lattice, means, all pairs.
    #[test]
    fn agrees_with_brute_force(
        frames in prop::collection::vec(prop::collection::vec(0.5_f32..0.9, 12), 1..6),
        map in prop::collection::vec((-0.05_f32..0.2, -0.1_f32..0.1, 0.4_f32..1.0), 0..60),
    ) {
        let mut reference = ReferenceCloud::new(0.02).unwrap();
        // The readings, each with the number of its frame.
        let mut readings: Vec<(usize, Point)> = Vec::new();
        for (k, depths) in frames.into_iter().enumerate() {
            let frame = frame(depths);
            reference.add_frame(&frame, &Pose::identity(), 0.3, 0.8);
            let depths = frame.depth().data().iter().enumerate().filter(|&(_, &z)| z <= 0.8);
            readings.extend(depths.map(|(u, &z)| {
                (k, frame.camera().back_project([u as f64, 0.0], z.into()).map(|c| c as f32))
            }));
        }
        let map: Vec<(usize, Point)> = map.into_iter().map(|(x, y, z)| (0, [x, y, z])).collect();
        let points: Vec<Point> = map.iter().map(|&(_, point)| point).collect();
        let score = reference.score(&points);

        let (all, often, map) = (voxel_means(&readings, 1), voxel_means(&readings, 3), voxel_means(&map, 1));
        let distance = |a: &Point, b: &Point| (0..3).map(|i| (a[i] - b[i]).powi(2)).sum::<f32>().sqrt();
        let residue = map.iter().filter(|m| all.iter().all(|r| distance(m, r) > 0.06)).count();
        let complete = often.iter().filter(|r| map.iter().any(|m| distance(m, r) <= 0.05)).count();
        prop_assert_eq!(score.map_voxels, map.len());
        prop_assert_eq!(score.reference_voxels, often.len());
        prop_assert!((score.residue * map.len() as f64 - residue as f64).abs() < 1e-6);
        if !often.is_empty() {
            prop_assert!((score.completeness * often.len() as f64 - complete as f64).abs() < 1e-6);
        }
    }
}

/// Means of the points in each voxel of 2 cm that at least `min_frames` frames hit.
fn voxel_means(points: &[(usize, Point)], min_frames: usize) -> Vec<Point> {
    let mut voxels: BTreeMap<[i64; 3], Vec<(usize, Point)>> = BTreeMap::new();
    for &(frame, point) in points {
        voxels.entry(point.map(|c| (c * 50.0).floor() as i64)).or_default().push((frame, point));
    }
    let often = voxels.values().filter(|points| {
        let mut frames: Vec<usize> = points.iter().map(|&(frame, _)| frame).collect();
        frames.dedup();
        frames.len() >= min_frames
    });
    let mean = |points: &Vec<(usize, Point)>| -> Point {
        std::array::from_fn(|i| {
            (points.iter().map(|(_, p)| f64::from(p[i])).sum::<f64>() / points.len() as f64) as f32
        })
    };
    often.map(mean).collect()
}

#[test]
fn nothing_is_scored_as_nothing() {
    let empty = ReferenceCloud::new(0.02).unwrap();
    assert!(empty.is_empty());
    let score = empty.score(&[[0.0; 3], [f32::NAN; 3], [f32::MAX; 3]]);
    assert_eq!((score.residue, score.completeness, score.map_voxels), (1.0, 1.0, 2));
    let mut reference = ReferenceCloud::new(0.02).unwrap();
    for _ in 0..3 {
        reference.add_frame(&frame(vec![1.0, 0.0]), &Pose::identity(), 0.3, 4.0);
    }
    let score = reference.score(&[]);
    assert_eq!((score.residue, score.completeness, score.reference_voxels), (0.0, 0.0, 1));
    assert!(ReferenceCloud::new(f64::NAN).is_err() && ReferenceCloud::new(0.0).is_err());
}

/// The kitchen recording with people inserted, against the one without. The expected shares were computed
/// independently of this crate when the data set was made. Residue: all frames stitched as they are 31.6 %,
/// with the raw person boxes removed 2.08 %, with only those of score >= 0.7 removed 6.27 %, with the exact
/// masks removed 0.000 %; completeness 99.9 % each. It is not known how boxes were rounded to pixels: whole
/// pixels less at the far sides give 2.087 and 6.268 % here, pixel centres within half-open boxes 2.058 and
/// 6.240 %.
#[test]
#[ignore = "a thousand frames: .ci/nightly"]
fn the_kitchen_gives_its_known_figures() {
    let Some(people) = recording("kitchen_people") else { return };
    let clean = people.with_file_name("kitchen");
    let mut reference = ReferenceCloud::new(0.02).unwrap();
    for recorded in recorded_frames(&clean) {
        reference.add_frame(&recorded.frame, &recorded.world_from_camera, 0.3, 4.0);
    }
    // Nothing removed, all boxes, boxes of a high score, exact masks.
    let mut maps: [Stitched; 4] = Default::default();
    for recorded in recorded_frames(&people) {
        let nothing = Mask::filled(640, 480, false).unwrap();
        let boxes = |min_score| box_mask(&recorded.detections, min_score);
        let masks = [nothing, boxes(0.25), boxes(0.7), recorded.people()];
        stitch(&mut maps, &masks, &recorded.frame, &recorded.world_from_camera);
    }
    let scores = maps.map(|map| {
        let means = map.values().map(|(sum, points)| sum.map(|c| (c / points) as f32));
        reference.score(&means.collect::<Vec<Point>>())
    });
    let shares: Vec<[f64; 2]> = scores.iter().map(|s| [100.0 * s.residue, 100.0 * s.completeness]).collect();
    eprintln!("residue and completeness in %: as is, boxes, boxes >= 0.7, exact masks: {shares:.3?}");
    for (score, expected) in scores.iter().zip([0.316, 0.0208, 0.0627, 0.0]) {
        let ReferenceScore { residue, completeness, .. } = score;
        assert!((residue - expected).abs() < 0.0006, "residue {residue}, not {expected}");
        assert!(*completeness > 0.999, "completeness {completeness}");
    }
}

/// Sum and number of the points in each voxel of 2 cm: a list of all readings would take a gigabyte.
type Stitched = HashMap<[i32; 3], ([f64; 3], f64)>;

fn stitch(maps: &mut [Stitched; 4], masks: &[Mask; 4], frame: &Frame, world_from_camera: &Pose) {
    let camera = frame.camera();
    let mut runs = [([i32::MAX; 3], ([0.0; 3], 0.0)); 4];
    let put = |map: &mut Stitched, (voxel, (sum, points)): ([i32; 3], ([f64; 3], f64))| {
        let entry = map.entry(voxel).or_default();
        (0..3).for_each(|i| entry.0[i] += sum[i]);
        entry.1 += points;
    };
    for v in 0..camera.height() {
        for u in 0..camera.width() {
            let z = frame.depth().at(u, v);
            if !(0.3..=4.0).contains(&z) {
                continue;
            }
            let point = camera.back_project([u as f64, v as f64], z.into());
            let point = world_from_camera.transform_point(point);
            let voxel = point.map(|c| (c * 50.0).floor() as i32);
            for ((map, mask), run) in maps.iter_mut().zip(masks).zip(&mut runs) {
                if mask.at(u, v) {
                    continue;
                }
                if voxel != run.0 {
                    if run.1.1 > 0.0 {
                        put(map, *run);
                    }
                    *run = (voxel, ([0.0; 3], 0.0));
                }
                (0..3).for_each(|i| run.1.0[i] += point[i]);
                run.1.1 += 1.0;
            }
        }
    }
    maps.iter_mut().zip(runs).filter(|(_, run)| run.1.1 > 0.0).for_each(|(map, run)| put(map, run));
}

fn box_mask(detections: &[Detection], min_score: f32) -> Mask {
    let mut mask = Mask::filled(640, 480, false).unwrap();
    for person in detections.iter().filter(|d| d.label() == "person" && d.score() >= min_score) {
        mask.fill_box(&person.bounding_box(), true);
    }
    mask
}
