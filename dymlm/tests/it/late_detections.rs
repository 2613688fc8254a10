//! Detections that come when their frame has been mapped without them.

use crate::common::{config, fingerprint, fingerprint_without_ids, sequence};
use dymlm::core::{Detection, FrameId};
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
    assert_eq!(fingerprint(builder.map()), first);
    builder.correct_poses(&[]).unwrap();
    assert_eq!(fingerprint(builder.map()), first);
}
