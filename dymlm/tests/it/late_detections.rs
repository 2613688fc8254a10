//! Detections that come when their frame has been mapped without them.

use crate::common::{config, fingerprint, fingerprint_without_ids, insert_all, poses, sequence};
use dymlm::core::{Detection, FrameId, Pose};
use dymlm::{Detections, Error, FrameOutcome, HistoryConfig, MapBuilder};
use dymlm_sim::SimulatedFrame;

fn builder(history: HistoryConfig) -> MapBuilder {
    let mut config = config();
    config.history = history;
    MapBuilder::new(config).unwrap()
}

fn insert(builder: &mut MapBuilder, frame: &SimulatedFrame, found: Detections<'_>) -> FrameId {
    let report = builder.insert(&frame.frame, found, &frame.world_from_camera).unwrap();
    assert!(report.update().is_some());
    report.id
}

/// Every fifth frame of a walk: all are key frames.
fn frames() -> Vec<SimulatedFrame> {
    sequence(40).frames().step_by(5).collect()
}

fn people(frame: &SimulatedFrame) -> usize {
    frame.detections.iter().filter(|detection| detection.label() == "person").count()
}

#[test]
fn a_frame_is_mapped_as_if_its_detections_had_been_there() {
    let frames = frames();
    let first = frames.iter().find(|frame| people(frame) > 0).unwrap();
    let mut late = builder(HistoryConfig::Memory);
    let id = insert(&mut late, first, Detections::NotRun);
    let without = fingerprint_without_ids(late.map());
    let report = late.detections_for(id, &first.detections).unwrap();
    assert!(matches!(report.outcome, FrameOutcome::Mended(_)), "{:?}", report.outcome);
    assert!(!report.movers.is_empty() && report.masked_pixels > 0);

    let mut in_time = builder(HistoryConfig::Memory);
    insert(&mut in_time, first, Detections::Found(&first.detections));
    assert!(fingerprint_without_ids(late.map()) == fingerprint_without_ids(in_time.map()));
    assert!(fingerprint_without_ids(late.map()) != without);
}

/// Regression: nothing kept it any longer, but it was in no map until another frame came.
#[test]
fn a_frame_behind_one_that_is_removed_is_mapped_at_once() {
    let frames = frames();
    let mut builder = builder(HistoryConfig::Memory);
    let [waits, behind, next] = [&frames[0], &frames[1], &frames[2]];
    let id = builder.insert(&waits.frame, Detections::Pending, &waits.world_from_camera).unwrap().id;
    builder.insert(&behind.frame, Detections::Found(&behind.detections), &behind.world_from_camera).unwrap();
    assert_eq!(builder.map().cloud().held_voxels(), 0);
    assert_eq!(builder.remove(id).unwrap().key_frames, 1);
    assert!(builder.map().cloud().held_voxels() > 0);
    let report = builder.insert(&next.frame, &next.detections, &next.world_from_camera).unwrap();
    assert_eq!(report.released.len(), 1);
    assert!(report.released[0].update().is_some() && report.released[0].id == FrameId::new(1));
}

#[test]
fn what_was_seen_of_people_in_a_frame_of_many_leaves_the_maps() {
    let frames = frames();
    let missed = frames.iter().position(|frame| people(frame) > 0).unwrap();
    let cells = |found_late: bool| {
        let mut builder = builder(HistoryConfig::Memory);
        let mut id = None;
        for (index, frame) in frames.iter().enumerate() {
            let found =
                if index == missed { Detections::NotRun } else { Detections::Found(&frame.detections) };
            let own = insert(&mut builder, frame, found);
            id = id.or((index == missed).then_some(own));
        }
        if found_late {
            builder.detections_for(id.unwrap(), &frames[missed].detections).unwrap();
        }
        builder.map().cloud().held_voxels()
    };
    assert!(cells(true) < cells(false));
}

#[test]
fn what_is_refused_changes_nothing() {
    let frames = frames();
    let frame = &frames[0];
    let mut without_history = builder(HistoryConfig::None);
    let id = insert(&mut without_history, frame, Detections::NotRun);
    let refused = without_history.detections_for(id, &frame.detections);
    assert!(matches!(refused, Err(Error::NotPending { .. })));

    let mut builder = builder(HistoryConfig::Memory);
    let detected = insert(&mut builder, frame, Detections::Found(&[]));
    let missed = insert(&mut builder, &frames[1], Detections::NotRun);
    let first = fingerprint(builder.map());
    for id in [detected, FrameId::new(7)] {
        assert!(matches!(builder.detections_for(id, &[]), Err(Error::NotPending { .. })));
    }
    let mask = dymlm::core::Mask::filled(3, 3, true).unwrap();
    let person = Detection::new("person", 0.9, frame.detections[0].bounding_box()).unwrap().with_mask(mask);
    assert!(matches!(builder.detections_for(missed, &[person]), Err(Error::Dynamics(_))));
    assert!(fingerprint(builder.map()) == first);
    builder.correct_poses(&[]).unwrap();
    assert!(fingerprint(builder.map()) == first);
}

/// Six frames, the fifth of which awaits its detections, and the sixth the fifth.
fn waiting() -> (MapBuilder, Vec<SimulatedFrame>) {
    let frames = frames()[..6].to_vec();
    let mut builder = builder(HistoryConfig::Memory);
    for (index, frame) in frames.iter().enumerate() {
        let found = if index == 4 { Detections::Pending } else { Detections::Found(&frame.detections) };
        builder.insert(&frame.frame, found, &frame.world_from_camera).unwrap();
    }
    (builder, frames)
}

/// The newest frame stays, as where a SLAM holds its newest pose; or it moves, while what has been mapped stays.
#[test]
fn a_frame_that_waits_is_mapped_where_a_correction_puts_it() {
    for moved in [&[4][..], &[4, 5]] {
        let (mut waiting, mut frames) = waiting();
        let shift = Pose::new([0.05, 0.0, 0.02], [0.0, 0.0, 0.0, 1.0]).unwrap();
        for &index in moved {
            frames[index].world_from_camera = shift * frames[index].world_from_camera;
        }
        let corrected = [4, 5].map(|index| (FrameId::new(index), frames[index as usize].world_from_camera));
        waiting.correct_poses(&corrected).unwrap();
        waiting.detections_for(FrameId::new(4), &frames[4].detections).unwrap();

        let mut built_there = builder(HistoryConfig::Memory);
        insert_all(&mut built_there, &frames);
        assert!(fingerprint(waiting.map()) == fingerprint(built_there.map()), "{moved:?}");
    }
}

#[test]
fn a_frame_that_waits_is_not_put_beyond_the_maps_reach() {
    let (mut builder, frames) = waiting();
    let before = (fingerprint(builder.map()), poses(&builder));
    let far = Pose::new([1e9, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let newest = (FrameId::new(5), frames[5].world_from_camera);
    let refused = builder.correct_poses(&[(FrameId::new(4), far), newest]);
    assert!(matches!(refused, Err(Error::Cloud(_))), "{refused:?}");
    assert!((fingerprint(builder.map()), poses(&builder)) == before);
    builder.detections_for(FrameId::new(4), &frames[4].detections).unwrap();
}

#[test]
fn a_mended_frame_is_reported_at_the_time_at_which_it_was_given() {
    let frames = frames();
    let mut builder = builder(HistoryConfig::Memory);
    insert(&mut builder, &frames[1], Detections::Found(&[]));
    // Another session, whose clock begins anew.
    builder.begin_session().unwrap();
    let id = insert(&mut builder, &frames[0], Detections::NotRun);
    let report = builder.detections_for(id, &frames[0].detections).unwrap();
    assert_eq!(report.timestamp, frames[0].frame.timestamp());
}
