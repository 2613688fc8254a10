//! Maps that follow when poses are corrected: equal to the bit to maps that are built anew, ids that stay,
//! refusals that change nothing.

#![allow(clippy::unwrap_used, reason = "tests")]

mod common;

use common::{config, fingerprint, fingerprint_without_ids, ids, insert_all, sequence};
use dymlm::core::{FrameId, Pose};
use dymlm::{Error, HistoryConfig, MapBuilder, MapConfig};
use dymlm_sim::SimulatedFrame;
use proptest::prelude::*;

fn with_history() -> MapConfig {
    let mut config = config();
    config.history = HistoryConfig::Memory;
    config
}

/// Every fifth frame of a walk: all are key frames.
fn frames(count: usize) -> Vec<SimulatedFrame> {
    sequence(5 * count).frames().step_by(5).collect()
}

fn mapped(frames: &[SimulatedFrame]) -> MapBuilder {
    let mut builder = MapBuilder::new(with_history()).unwrap();
    insert_all(&mut builder, frames);
    builder
}

fn poses(builder: &MapBuilder) -> Vec<(FrameId, Pose)> {
    builder.trajectory().map(|(id, _, pose)| (id, pose)).collect()
}

/// A drift that grows with the frames.
fn drifted(poses: &[(FrameId, Pose)], meters: f64, radians: f64) -> Vec<(FrameId, Pose)> {
    let drift = |&(id, pose): &(FrameId, Pose)| {
        let share = id.get() as f64 / poses.len() as f64;
        let half = 0.5 * radians * share;
        let step = Pose::new([meters * share, 0.0, 0.0], [0.0, 0.0, half.sin(), half.cos()]).unwrap();
        (id, step * pose)
    };
    poses.iter().map(drift).collect()
}

#[test]
fn maps_that_were_corrected_back_are_the_first_to_the_bit() {
    let mut builder = mapped(&frames(14));
    let (first, known) = (fingerprint_without_ids(builder.map()), ids(builder.map()));
    let right = poses(&builder);
    let report = builder.correct_poses(&drifted(&right, 0.4, 0.1)).unwrap();
    assert!(fingerprint_without_ids(builder.map()) != first);

    assert!(report.moved_key_frames + 1 >= report.key_frames && report.largest_motion > 0.4, "{report:?}");
    assert!(!report.planes.moved.is_empty() && !report.objects.moved.is_empty());

    let report = builder.correct_poses(&right).unwrap();
    assert_eq!(poses(&builder), right);
    assert!(report.planes.vanished.is_empty() && report.objects.vanished.is_empty());
    assert_eq!(ids(builder.map()), known);
    assert!(fingerprint_without_ids(builder.map()) == first);
}

#[test]
fn nothing_changes_without_a_change() {
    let mut builder = mapped(&frames(8));
    let first = fingerprint(builder.map());
    let report = builder.correct_poses(&[]).unwrap();
    assert_eq!((report.moved_key_frames, report.largest_motion), (0, 0.0));
    assert!(report.planes.moved.is_empty() && report.objects.moved.is_empty());
    assert_eq!(fingerprint(builder.map()), first);
}

#[test]
fn a_moved_world_is_the_map_of_moved_poses() {
    // Nobody in it: masks do not depend on the world's axes.
    let mut config = dymlm_sim::SequenceConfig::default();
    config.frames = 30;
    config.people = 0;
    config.camera = sequence(1).frames().next().map(|frame| *frame.frame.camera());
    let still: Vec<SimulatedFrame> = dymlm_sim::Sequence::new(&config).unwrap().frames().step_by(5).collect();
    let new_from_old = Pose::new([3.0, -1.0, 0.5], [0.0, 0.0, 0.6, 0.8]).unwrap();

    let mut moved = mapped(&still);
    moved.transform(&new_from_old).unwrap();
    let mut direct = MapBuilder::new(with_history()).unwrap();
    for frame in &still {
        direct.insert(&frame.frame, &frame.detections, &(new_from_old * frame.world_from_camera)).unwrap();
    }
    assert_eq!(fingerprint(moved.map()), fingerprint(direct.map()));
}

#[test]
fn a_session_goes_on_after_a_correction_as_if_it_had_begun_there() {
    let all = frames(16);
    let (early, late) = all.split_at(10);
    let mut builder = mapped(early);
    let right = poses(&builder);
    builder.correct_poses(&drifted(&right, 0.2, 0.05)).unwrap();
    builder.correct_poses(&right).unwrap();
    insert_all(&mut builder, late);

    assert!(fingerprint_without_ids(builder.map()) == fingerprint_without_ids(mapped(&all).map()));
}

#[test]
fn frames_are_taken_out_one_by_one_until_nothing_is_left() {
    let all = frames(6);
    let mut builder = mapped(&all);
    let without_last = mapped(&all[..5]);
    builder.remove(FrameId::new(5)).unwrap();
    assert_eq!(fingerprint_without_ids(builder.map()), fingerprint_without_ids(without_last.map()));
    for id in 0..5 {
        builder.remove(FrameId::new(id)).unwrap();
    }
    let counts = builder.map().counts();
    assert_eq!((counts.cloud_voxels, counts.octree_leaves, counts.planes, counts.objects), (0, 0, 0, 0));
    assert_eq!(ids(builder.map()), (Vec::new(), Vec::new()));
}

#[test]
fn what_is_refused_changes_nothing() {
    let mut without = MapBuilder::new(config()).unwrap();
    let all = frames(4);
    insert_all(&mut without, &all);
    assert!(matches!(without.correct_poses(&[]), Err(Error::NoHistory)));
    assert_eq!(without.trajectory().count(), 0);

    let mut builder = mapped(&all);
    let first = fingerprint(builder.map());
    let (known, unknown) = (FrameId::new(0), FrameId::new(4));
    let far = Pose::new([1e12, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let refused = builder.correct_poses(&[(unknown, Pose::identity())]);
    assert!(matches!(refused, Err(Error::UnknownFrame { frame }) if frame == unknown));
    assert!(matches!(builder.correct_poses(&[(known, far)]), Err(Error::Cloud(_))));
    assert!(builder.remove(unknown).is_err());
    let mut steps = 0;
    let cancelled = builder.correct_poses_watched(&drifted(&poses(&builder), 0.3, 0.0), &mut |progress| {
        steps = progress.done;
        progress.done < progress.total
    });
    assert!(matches!(cancelled, Err(Error::Cancelled)) && steps == 4);
    assert_eq!(fingerprint(builder.map()), first);
    builder.correct_poses(&[]).unwrap();
    assert_eq!(fingerprint(builder.map()), first);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(6))]
    #[test]
    fn corrections_in_any_order_and_number_end_in_the_map_of_their_last_poses(
        steps in prop::collection::vec((prop::collection::vec(0_u64..9, 1..4), -0.2_f64..0.2, -0.1_f64..0.1), 1..4),
    ) {
        let mut builder = mapped(&frames(9));
        for (chosen, meters, radians) in steps {
            let all = drifted(&poses(&builder), meters, radians);
            let given: Vec<_> = all.into_iter().filter(|(id, _)| chosen.contains(&id.get())).collect();
            builder.correct_poses(&given).unwrap();
            for (id, pose) in given {
                prop_assert_eq!(poses(&builder)[id.get() as usize].1, pose);
            }
        }
        let last = fingerprint_without_ids(builder.map());
        let mut again = mapped(&frames(9));
        again.correct_poses(&poses(&builder)).unwrap();
        prop_assert!(fingerprint_without_ids(again.map()) == last);
    }
}
