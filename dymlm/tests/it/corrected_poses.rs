//! Maps that follow when poses are corrected: equal to the bit to maps that are built anew, ids that stay,
//! refusals that change nothing. Random sessions are in `src/correction/random_sessions.rs`.

use crate::common::{
    config, correct_counted, fine_camera, fingerprint, fingerprint_without_ids, ids, insert_all, poses,
    sequence,
};
use dymlm::core::{DepthImage, Frame, FrameId, PinholeCamera, Pose, SplitMix64};
use dymlm::{Detections, Error, FrameOutcome, HistoryConfig, MapBuilder, MapConfig};
use dymlm_sim::SimulatedFrame;

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

/// Regression: it stayed, and all objects were made upright by it.
#[test]
fn what_is_said_to_be_up_turns_with_the_world() {
    let mut config = with_history();
    config.objects.parameterization.up = Some([0.0, 0.0, 1.0]);
    let mut builder = MapBuilder::new(config).unwrap();
    insert_all(&mut builder, &frames(6));
    let heights = |builder: &MapBuilder, up: [f64; 3]| -> Vec<f64> {
        let objects = builder.map().objects().objects();
        objects
            .map(|object| (0..3).map(|axis| object.oriented_box().center()[axis] * up[axis]).sum())
            .collect()
    };
    let before = heights(&builder, [0.0, 0.0, 1.0]);
    let half = 0.5_f64.sqrt();
    builder.transform(&Pose::new([0.0; 3], [half, 0.0, 0.0, half]).unwrap()).unwrap();
    let up = builder.map().up().unwrap();
    assert!((up[1] + 1.0).abs() < 1e-9, "{up:?}");
    let after = heights(&builder, up);
    assert!(!before.is_empty() && before.len() == after.len());
    assert!(before.iter().zip(&after).all(|(a, b)| (a - b).abs() < 0.02), "{before:?} {after:?}");
    let configs = [builder.config(), builder.map().config()];
    let [own, saved] = configs.map(|config| config.objects.parameterization.up.unwrap());
    assert!(own == saved && (own[1] + 1.0).abs() < 1e-9);
    // A turn about it changes nothing of it.
    builder.transform(&Pose::new([1.0, 2.0, 3.0], [0.0, -0.28, 0.0, 0.96]).unwrap()).unwrap();
    assert_eq!(builder.map().up(), Some(up));
}

/// With no frame mapped yet, nothing was replayed, and the maps kept the old direction.
#[test]
fn a_given_up_turns_before_anything_is_mapped() {
    let mut config = with_history();
    config.objects.parameterization.up = Some([0.0, 0.0, 1.0]);
    let mut builder = MapBuilder::new(config).unwrap();
    let first = &frames(1)[0];
    builder.insert(&first.frame, Detections::Pending, &first.world_from_camera).unwrap();
    let half = 0.5_f64.sqrt();
    builder.transform(&Pose::new([0.0; 3], [half, 0.0, 0.0, half]).unwrap()).unwrap();
    assert_eq!(builder.config(), builder.map().config());
    let up = builder.map().up().unwrap();
    assert!((up[1] + 1.0).abs() < 1e-9, "{up:?}");
}

#[test]
fn nothing_changes_without_a_change() {
    let mut builder = mapped(&frames(8));
    let first = fingerprint(builder.map());
    // A SLAM has a type of its own for poses. Regression: on the way back, last bits changed.
    let handed_back =
        |(id, pose): (FrameId, Pose)| (id, Pose::new(pose.translation(), pose.quaternion()).unwrap());
    let all: Vec<_> = poses(&builder).into_iter().map(handed_back).collect();
    for given in [&[][..], &all] {
        let report = builder.correct_poses(given).unwrap();
        assert_eq!((report.moved_key_frames, report.largest_motion), (0, 0.0));
        assert!(report.planes.moved.is_empty() && report.objects.moved.is_empty());
        assert!(fingerprint(builder.map()) == first);
    }
}

#[test]
fn a_moved_world_is_the_map_of_moved_poses() {
    // Nobody in it: masks do not depend on the world's axes.
    let mut config = dymlm_sim::SequenceConfig::default();
    config.frames = 30;
    config.people = 0;
    // Finer than elsewhere: in smaller images a few pixels are taken for a mover.
    config.camera = Some(fine_camera());
    let still: Vec<SimulatedFrame> = dymlm_sim::Sequence::new(&config).unwrap().frames().step_by(5).collect();
    let new_from_old = Pose::new([3.0, -1.0, 0.5], [0.0, 0.0, 0.6, 0.8]).unwrap();

    let mut moved = mapped(&still);
    let report = moved.transform(&new_from_old).unwrap();
    assert!(
        report.new_from_old.distance(&new_from_old) < 1e-9 && report.new_from_old.angle(&new_from_old) < 1e-9
    );
    let mut direct = MapBuilder::new(with_history()).unwrap();
    for frame in &still {
        direct.insert(&frame.frame, &frame.detections, &(new_from_old * frame.world_from_camera)).unwrap();
    }
    assert!(fingerprint(moved.map()) == fingerprint(direct.map()));
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

/// Regression: the log held a radius that equals nothing, and the session was no longer the same as itself.
#[test]
fn to_forget_outside_of_no_place_forgets_nothing() {
    let mut builder = mapped(&frames(3));
    let first = fingerprint(builder.map());
    builder.forget_outside([0.0; 3], f64::NAN);
    builder.forget_outside([0.0, f64::INFINITY, 0.0], 1.0);
    assert!(fingerprint(builder.map()) == first);
    let map = builder.into_map();
    let mut twice = map.clone();
    twice.merge(&map, &Pose::identity()).unwrap();
    assert!(fingerprint(&twice) == first);
}

#[test]
fn frames_are_taken_out_one_by_one_until_nothing_is_left() {
    let all = frames(6);
    let mut builder = mapped(&all);
    let without_last = mapped(&all[..5]);
    builder.remove(FrameId::new(5)).unwrap();
    assert!(fingerprint_without_ids(builder.map()) == fingerprint_without_ids(without_last.map()));
    for id in 0..5 {
        builder.remove(FrameId::new(id)).unwrap();
    }
    let counts = builder.map().counts();
    assert_eq!((counts.cloud_voxels, counts.octree_leaves, counts.planes, counts.objects), (0, 0, 0, 0));
    assert_eq!(ids(builder.map()), (Vec::new(), Vec::new()));
}

#[test]
fn a_frame_that_is_in_no_map_is_taken_out_without_building_them_again() {
    let all = frames(4);
    let mut builder = mapped(&all[..3]);
    let last = &all[2];
    let tracked = builder.insert(&last.frame, &last.detections, &last.world_from_camera).unwrap();
    assert!(matches!(tracked.outcome, FrameOutcome::Tracked));
    let waiting = builder.insert(&all[3].frame, Detections::Pending, &all[3].world_from_camera).unwrap();
    let (first, revision) = (fingerprint(builder.map()), builder.map().revision());
    for frame in [tracked.id, waiting.id] {
        let report = builder.remove(frame).unwrap();
        assert_eq!((report.key_frames, report.moved_key_frames, report.largest_motion), (3, 0, 0.0));
    }
    assert_eq!(builder.map().revision(), revision);
    assert!(builder.detections_for(waiting.id, &[]).is_err());
    assert!(builder.process_waiting().unwrap().is_empty());
    assert!(fingerprint(builder.map()) == first);
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
    assert!(fingerprint(builder.map()) == first);
    builder.correct_poses(&[]).unwrap();
    assert!(fingerprint(builder.map()) == first);
}

#[test]
fn a_correction_early_in_a_further_session_maps_none_of_the_one_before_again() {
    let frames = frames(14);
    let mut builder = MapBuilder::resume(mapped(&frames[..8]).into_map()).unwrap();
    insert_all(&mut builder, &frames[8..]);
    let late = drifted(&poses(&builder), 0.1, 0.0).split_off(11);
    let (report, total) = correct_counted(&mut builder, &late);
    assert_eq!(report.key_frames, 14);
    assert!(total <= 6, "{total} key frames were mapped again");
    let corrected = fingerprint_without_ids(builder.map());
    // From the beginning, since the first frame moves as well, there and back.
    let right = poses(&builder);
    builder.transform(&Pose::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap()).unwrap();
    builder.correct_poses(&right).unwrap();
    assert!(fingerprint_without_ids(builder.map()) == corrected);
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn a_correction_of_the_last_frames_maps_few_again_to_the_same_bits() {
    let all = frames(30);
    let mut builder = mapped(&all);
    let right = poses(&builder);
    let mut late = drifted(&right, 0.3, 0.1);
    late.drain(..24);
    // From the first such correction on.
    builder.correct_poses(&late).unwrap();
    builder.correct_poses(&right).unwrap();
    let (_, total) = correct_counted(&mut builder, &late);
    assert!((6..=12).contains(&total), "{total}");

    let mut moved = all.clone();
    for (frame, (id, _, pose)) in moved.iter_mut().zip(builder.trajectory()) {
        assert_eq!(id.get() >= 24, frame.world_from_camera != pose);
        frame.world_from_camera = pose;
    }
    let mut again = MapBuilder::new(with_history()).unwrap();
    insert_all(&mut again, &all);
    // From the beginning: the first frame leaves its place and comes back.
    let mut away = poses(&again);
    away[0].1 = moved[29].world_from_camera;
    again.correct_poses(&away).unwrap();
    again.correct_poses(&poses(&builder)).unwrap();
    assert!(fingerprint_without_ids(builder.map()) == fingerprint_without_ids(again.map()));
}

/// Regression: rounding moved frames between two that had not moved, so that everything was mapped again each
/// time.
#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn who_hands_over_all_poses_has_mapped_again_what_has_moved() {
    let (mut all, mut random) = (frames(30), SplitMix64::new(3));
    for frame in &mut all {
        let time = frame.frame.timestamp() + 0.02 * random.fraction();
        frame.frame.set_timestamp(time).unwrap();
    }
    let mut builder = mapped(&all);
    let right = poses(&builder);
    let mut total = 0;
    for meters in [0.05, 0.1] {
        // A SLAM's own key frames, of which a local optimization has moved the last two.
        let shift = Pose::new([meters, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let given: Vec<_> = (0..30)
            .filter(|place| place % 4 == 0 || *place > 27)
            .map(|place| (right[place].0, if place < 28 { right[place].1 } else { shift * right[place].1 }))
            .collect();
        (_, total) = correct_counted(&mut builder, &given);
        assert_eq!(poses(&builder)[..25], right[..25]);
    }
    // The first one was the first such correction.
    assert!((5..=10).contains(&total), "{total} key frames were mapped again");
}

/// Regression: what was forgotten about a frame that is in no map any more stayed forgotten at the old place.
#[test]
fn what_was_forgotten_about_a_removed_frame_follows_its_pose() {
    let all = frames(8);
    let mut builder = mapped(&all[..4]);
    let removed = FrameId::new(3);
    builder.forget_outside(all[3].world_from_camera.translation(), 2.0);
    builder.remove(removed).unwrap();
    builder.begin_session().unwrap();
    insert_all(&mut builder, &all[4..]);
    let moved = Pose::new([1.5, 0.5, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    builder.correct_poses(&[(removed, moved * all[3].world_from_camera)]).unwrap();
    let corrected = fingerprint_without_ids(builder.map());
    // From the beginning, since the first frame moves as well, there and back.
    let right = poses(&builder);
    builder.transform(&moved).unwrap();
    builder.correct_poses(&right).unwrap();
    assert!(fingerprint_without_ids(builder.map()) == corrected);
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn many_corrections_do_not_use_up_ids() {
    let mut builder = mapped(&frames(12));
    let right = poses(&builder);
    let known = ids(builder.map());
    let given = |builder: &MapBuilder| builder.map().planes().ids_given();
    let mut largest = 0;
    for round in 0..6 {
        let moved = drifted(&right, 0.02 * f64::from(round), 0.01);
        let first = 2 * usize::try_from(round).unwrap();
        builder.correct_poses(&moved[first..]).unwrap();
        builder.correct_poses(&right).unwrap();
        assert_eq!(ids(builder.map()), known);
        largest = given(&builder);
    }
    assert!(largest < 3 * 60, "{largest}");
}

/// Regression: the frames of which the preprocessor and the choice of key frames know the poses were guessed by
/// their ids.
#[test]
fn what_is_known_of_the_last_processed_frame_moves_with_that_frame() {
    // All within the interval of key frames.
    let mut config = dymlm_sim::SequenceConfig::default();
    (config.frames, config.frame_rate) = (4, 100.0);
    config.camera = sequence(1).frames().next().map(|frame| *frame.frame.camera());
    let frames: Vec<SimulatedFrame> = dymlm_sim::Sequence::new(&config).unwrap().frames().collect();
    let pose = frames[0].world_from_camera;
    let moved = Pose::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap() * pose;
    let is_key_frame = |builder: &mut MapBuilder, index: usize| {
        builder.insert(&frames[index].frame, Detections::NotRun, &pose).unwrap().update().is_some()
    };

    // A frame that waited was removed, and so was never processed.
    let mut builder = MapBuilder::new(with_history()).unwrap();
    assert!(is_key_frame(&mut builder, 0));
    let first = builder.insert(&frames[1].frame, Detections::Pending, &pose).unwrap().id;
    builder.remove(first).unwrap();
    let second = builder.insert(&frames[2].frame, Detections::Pending, &pose).unwrap().id;
    builder.correct_poses(&[(FrameId::new(0), pose), (second, moved)]).unwrap();
    builder.remove(second).unwrap();
    // The key frame before stands where it stood.
    assert!(!is_key_frame(&mut builder, 3));

    // Scans are mapped without it.
    let mut builder = MapBuilder::new(with_history()).unwrap();
    assert!(is_key_frame(&mut builder, 0));
    let scan = builder.insert_scan(frames[1].frame.timestamp(), &[[2.0, 0.0, 0.5]], &pose).unwrap().id;
    builder.correct_poses(&[(FrameId::new(0), pose), (scan, moved)]).unwrap();
    assert!(!is_key_frame(&mut builder, 2));
}

/// A walk along a wall, which sees each place in a few frames: poses, in the order of the frames.
fn along_a_wall(builder: &mut MapBuilder, frames: usize) -> Vec<(FrameId, Pose)> {
    let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).unwrap();
    for step in 0..frames {
        let depth = (0..64 * 48).map(|pixel| 1.5 + 0.01 * ((pixel * 7 + step) % 5) as f32).collect();
        let depth = DepthImage::new(64, 48, depth).unwrap();
        let frame = Frame::new(0.2 * step as f64, camera, depth, None).unwrap();
        let pose = Pose::new([0.25 * step as f64, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        builder.insert(&frame, &[], &pose).unwrap();
    }
    poses(builder)
}

/// Regression: unless the last frames had been corrected before, a loop closure had the whole session mapped
/// again, however long that had been and however short the loop.
#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn a_loop_closure_maps_again_what_has_come_since_the_loop_began_to_the_same_bits() {
    let mut builder = MapBuilder::new(with_history()).unwrap();
    let right = along_a_wall(&mut builder, 400);
    let memory = builder.memory();
    assert!(memory.snapshots < memory.total() / 3, "{memory:?}");

    let mut late = drifted(&right, 0.3, 0.0).split_off(340);
    assert_eq!(correct_counted(&mut builder, &right).1, 0);
    // One that is cancelled leaves the states from which the next one begins.
    let cancelled =
        builder.correct_poses_watched(&drifted(&right, 0.1, 0.0), &mut |progress| progress.done < 300);
    assert!(matches!(cancelled, Err(Error::Cancelled)));
    let (_, total) = correct_counted(&mut builder, &late);
    assert!((60..=200).contains(&total), "{total}");
    let corrected = fingerprint_without_ids(builder.map());
    // An earlier loop, then the later one again: from states that the replays have left.
    let (_, total) = correct_counted(&mut builder, &drifted(&right, 0.1, 0.0).split_off(200));
    assert!((200..=400).contains(&total), "{total}");
    assert!(fingerprint_without_ids(builder.map()) != corrected);
    let mut all = right.clone();
    all.truncate(340);
    all.append(&mut late);
    let (_, total) = correct_counted(&mut builder, &all);
    assert!((200..=400).contains(&total), "{total}");
    assert!(fingerprint_without_ids(builder.map()) == corrected);
    // From the beginning, since the first frame moves as well, there and back.
    builder.transform(&Pose::new([1.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap()).unwrap();
    builder.correct_poses(&all).unwrap();
    assert!(fingerprint_without_ids(builder.map()) == corrected);
}

#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn in_a_single_room_earlier_states_take_a_part_of_its_memory_at_most() {
    let (mut builder, all) = (MapBuilder::new(with_history()).unwrap(), frames(12));
    for turn in 0..10 {
        for frame in &all {
            let mut frame = frame.clone();
            frame.frame.set_timestamp(frame.frame.timestamp() + 10.0 * f64::from(turn)).unwrap();
            insert_all(&mut builder, &[frame]);
            let memory = builder.memory();
            assert!(memory.snapshots < (memory.total() - memory.history) * 6 / 10, "{memory:?}");
        }
    }
    // One of the states is left, from which the first correction of the last frames begins.
    let mut late = poses(&builder).split_off(118);
    let shift = Pose::new([0.01, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    for (_, pose) in &mut late {
        *pose = shift * *pose;
    }
    let (_, total) = correct_counted(&mut builder, &late);
    assert!(total < 75, "{total}");
}
