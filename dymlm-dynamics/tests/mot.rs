//! The tracker as a plain SORT on sequences of the MOT Challenge 2015.
#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod common;

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;

use common::data_folder;
use dymlm_core::{BoundingBox, Detection};
use dymlm_dynamics::{BoxSource, BoxTracker, TrackState, TrackerConfig};
use pathfinding::kuhn_munkres::kuhn_munkres;
use pathfinding::matrix::Matrix;

/// Identities and boxes, frame by frame.
type Tracks = BTreeMap<u32, Vec<(i64, BoundingBox)>>;

/// Reads `frame,id,left,top,width,height,...`; detections (id -1) as well.
fn read(file: &Path) -> Tracks {
    let mut tracks = Tracks::new();
    for line in fs::read_to_string(file).unwrap().lines() {
        let values: Vec<f32> = line.split(',').map(|value| value.trim().parse().unwrap()).collect();
        let (left, top) = (values[2], values[3]);
        let bounding_box = BoundingBox::new(left, top, left + values[4], top + values[5]).unwrap();
        tracks.entry(values[0] as u32).or_default().push((values[1] as i64, bounding_box));
    }
    tracks
}

/// The settings under which the tracker is SORT (gate 0.3, 3 hits, no coasting), but for one thing: it remembers
/// tracks for a second instead of a frame.
fn sort() -> TrackerConfig {
    let mut config = TrackerConfig::default();
    config.min_hits = 3;
    config.max_coast = 0.0;
    config
}

fn track(detections: &Tracks, frames: u32, config: TrackerConfig) -> Tracks {
    let mut tracker = BoxTracker::new(config).unwrap();
    let mut tracks = Tracks::new();
    for frame in 1..=frames {
        let boxes = detections.get(&frame).map_or(&[][..], Vec::as_slice);
        let detections: Vec<Detection> =
            boxes.iter().map(|(_, b)| Detection::new("person", 1.0, *b).unwrap()).collect();
        for tracked in tracker.update(f64::from(frame) / 30.0, &detections, None).unwrap() {
            assert!(matches!(tracked.source, BoxSource::Detected { .. }));
            // SORT holds boxes back until their track is confirmed, but for the first frames.
            if tracked.state == TrackState::Confirmed || frame <= 3 {
                tracks.entry(frame).or_default().push((tracked.track_id as i64, tracked.filtered_box));
            }
        }
    }
    tracks
}

#[derive(Debug)]
struct Score {
    mota: f64,
    idf1: f64,
}

/// CLEAR MOT (Bernardin and Stiefelhagen 2008) and IDF1 (Ristani et al. 2016) at an overlap of 0.5.
fn score(truth: &Tracks, tracks: &Tracks) -> Score {
    let mut matched: BTreeMap<i64, i64> = BTreeMap::new();
    let (mut objects, mut outputs, mut pairs, mut switches) = (0, 0, 0, 0);
    let mut together: BTreeMap<(i64, i64), i64> = BTreeMap::new();
    let none = Vec::new();
    for frame in truth.keys().chain(tracks.keys()).collect::<std::collections::BTreeSet<_>>() {
        let (truth, found) = (truth.get(frame).unwrap_or(&none), tracks.get(frame).unwrap_or(&none));
        objects += truth.len();
        outputs += found.len();
        for (id, a) in truth {
            for (track, _) in found.iter().filter(|(_, b)| a.iou(b) >= 0.5) {
                *together.entry((*id, *track)).or_default() += 1;
            }
        }
        // Pairs of the frames before stay while they overlap; the others are assigned anew.
        let mut kept: Vec<Option<usize>> = Vec::new();
        for (id, a) in truth {
            let column = found.iter().position(|(t, b)| matched.get(id) == Some(t) && a.iou(b) >= 0.5);
            kept.push(column.filter(|_| !kept.contains(&column)));
        }
        let size = truth.len().max(found.len());
        let weights =
            Matrix::from_fn(size, size, |(row, column)| match (truth.get(row), found.get(column)) {
                (Some((_, a)), Some((_, b)))
                    if a.iou(b) >= 0.5 && kept[row].is_none() && !kept.contains(&Some(column)) =>
                {
                    (1e6 * (1.0 + a.iou(b))) as i64
                }
                _ => 0,
            });
        let assigned = if size > 0 { kuhn_munkres(&weights).1 } else { Vec::new() };
        for (row, (id, _)) in truth.iter().enumerate() {
            let column = kept[row].or_else(|| (weights[(row, assigned[row])] > 0).then_some(assigned[row]));
            if let Some(column) = column {
                pairs += 1;
                let track = found[column].0;
                switches += i64::from(matched.insert(*id, track).is_some_and(|before| before != track));
            }
        }
    }

    let ids: Vec<i64> = together.keys().map(|key| key.0).collect();
    let found_ids: Vec<i64> = together.keys().map(|key| key.1).collect();
    let (ids, found_ids) = (unique(ids), unique(found_ids));
    let size = ids.len().max(found_ids.len());
    let weights = Matrix::from_fn(size, size, |(row, column)| {
        let key = (ids.get(row).copied().unwrap_or(-1), found_ids.get(column).copied().unwrap_or(-1));
        together.get(&key).copied().unwrap_or(0)
    });
    let id_pairs = kuhn_munkres(&weights).0;
    let errors = (objects - pairs) as f64 + (outputs - pairs) as f64 + switches as f64;
    Score { mota: 1.0 - errors / objects as f64, idf1: 2.0 * id_pairs as f64 / (objects + outputs) as f64 }
}

fn unique(mut ids: Vec<i64>) -> Vec<i64> {
    ids.sort_unstable();
    ids.dedup();
    ids
}

/// The figures to reach are those of SORT itself: the published `sort.py`, written anew on filterpy 2.0.0 and scipy's
/// `linear_sum_assignment`, scored by motmetrics 1.4.0 (`iou_matrix`, `max_iou` 0.5). Those of `example_tracks.txt`,
/// by motmetrics too, check the score above.
#[test]
fn tracks_at_least_as_well_as_sort() {
    let Some(folder) = data_folder("mot") else { return };
    for (name, frames, [mota, idf1], [example_mota, example_idf1]) in [
        ("TUD-Campus", 71, [0.626_741, 0.606_452], [0.526_462, 0.557_659]),
        ("TUD-Stadtmitte", 179, [0.717_128, 0.734_674], [0.564_014, 0.644_619]),
    ] {
        let truth = read(&folder.join(name).join("gt.txt"));
        let example = score(&truth, &read(&folder.join(name).join("example_tracks.txt")));
        assert!((example.mota - example_mota).abs() < 1e-6, "{example:?}");
        assert!((example.idf1 - example_idf1).abs() < 1e-6, "{example:?}");

        let detections = read(&folder.join(name).join("det.txt"));
        let ours = score(&truth, &track(&detections, frames, sort()));
        println!("{name}: MOTA {:.4} (SORT {mota:.4}), IDF1 {:.4} (SORT {idf1:.4})", ours.mota, ours.idf1);
        // Here: 0.6657 and 0.7657, 0.7258 and 0.7792.
        assert!(ours.mota >= mota && ours.idf1 >= idf1 + 0.03);
    }
}

/// Three people cross in front of each other; the detector misses one view in ten and jitters by two pixels.
#[test]
fn keeps_identities_where_paths_cross() {
    let mut truth = Tracks::new();
    let mut detections = Tracks::new();
    // A linear congruential generator is random enough to jitter boxes.
    let mut state = 7_u32;
    let mut random = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (state >> 8) as f32 / (1 << 24) as f32
    };
    for frame in 1..=150_u32 {
        let t = frame as f32;
        let people = [(0, 20.0 + 3.0 * t, 100.0), (1, 500.0 - 3.0 * t, 130.0), (2, 240.0, 40.0 + 0.5 * t)];
        for (id, x, y) in people {
            let boxed = |dx: f32, dy: f32| {
                BoundingBox::new(x + dx, y + dy, x + dx + 40.0, y + dy + 120.0 + 20.0 * id as f32).unwrap()
            };
            truth.entry(frame).or_default().push((id, boxed(0.0, 0.0)));
            let jitter = [4.0 * random() - 2.0, 4.0 * random() - 2.0];
            if random() >= 0.1 {
                detections.entry(frame).or_default().push((-1, boxed(jitter[0], jitter[1])));
            }
        }
    }
    let score = score(&truth, &track(&detections, 150, sort()));
    assert!(score.mota > 0.85 && score.idf1 > 0.93, "{score:?}");
}
