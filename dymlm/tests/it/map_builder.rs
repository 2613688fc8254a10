//! The facade: a walking sequence mapped end to end, the same bits twice, refused frames, key frames.

use crate::common::{config, fine_camera, fingerprint, insert_all, sequence, sequence_by};
use dymlm::core::vector3::difference;
use dymlm::core::{BoundingBox, DepthImage, Detection, Frame, Mask, PinholeCamera, Pose};
use dymlm::objects::SightedPoint;
use dymlm::planes::RejectionCause;
use dymlm::{
    Detections, Error, FrameInput, FrameOutcome, HistoryConfig, MapBuilder, MapConfig, Selection, Stage,
};
use dymlm_metrics::score_cloud;
use dymlm_sim::{SimulatedFrame, Truth, TruthConfig};

#[test]
fn people_who_walk_through_are_not_in_the_map() {
    let sequence = sequence_by(fine_camera(), 60);
    let frames: Vec<SimulatedFrame> = sequence.frames().collect();
    let mut truth = Truth::new(&sequence, &TruthConfig::default()).unwrap();
    for frame in &frames {
        truth.observe(frame);
    }
    assert!(frames.iter().filter(|frame| frame.mover_mask.count() > 2000).count() > 20, "people are in view");

    let mut config = config();
    config.cloud.voxel_size = 0.02;
    let mut builder = MapBuilder::new(config.clone()).unwrap();
    insert_all(&mut builder, &frames);
    let score = score_cloud(&builder.map().cloud().point_cloud(Selection::Static), &truth).unwrap();
    assert!(score.residue < 5e-4, "{score:?}");
    assert!(score.stray < 0.01, "{score:?}");
    assert!(score.completeness > 0.97, "{score:?}");
    assert!(score.median_distance < 0.012 && score.p95_distance < 0.035, "{score:?}");

    // The same without detections: most of them is masked as new in free space, and late removal takes out
    // nearly all of the rest.
    let mut blind = MapBuilder::new(config).unwrap();
    for frame in &frames {
        blind.insert(&frame.frame, &[], &frame.world_from_camera).unwrap();
    }
    let residue =
        |selection| score_cloud(&blind.map().cloud().point_cloud(selection), &truth).unwrap().residue;
    let [all, fixed] = [Selection::All, Selection::Static].map(residue);
    assert!(all < 0.02 && fixed < 0.1 * all, "{all} {fixed}");
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let frames: Vec<SimulatedFrame> = sequence(8).frames().collect();
    let build = || {
        let mut builder = MapBuilder::new(config()).unwrap();
        insert_all(&mut builder, &frames);
        fingerprint(&builder.into_map())
    };
    assert!(build() == build());
}

#[test]
fn a_refused_frame_changes_nothing() {
    let frames: Vec<SimulatedFrame> = sequence(4).frames().collect();
    let mut builder = MapBuilder::new(config()).unwrap();
    let mut undisturbed = MapBuilder::new(config()).unwrap();
    insert_all(&mut builder, &frames[..3]);
    insert_all(&mut undisturbed, &frames[..3]);
    let last = &frames[3];

    // Outside the maps, back in time, with a mask of another size.
    for place in [1e6, 1e9] {
        let far = Pose::new([place, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let error = builder.insert(&last.frame, &last.detections, &far).unwrap_err();
        assert!(matches!(error, Error::Planes(_) | Error::Cloud(_)), "{error}");
    }
    let early = &frames[0];
    let error = builder.insert(&early.frame, &early.detections, &early.world_from_camera).unwrap_err();
    assert!(matches!(error, Error::Dynamics(_)), "{error}");
    let person = Detection::new("person", 0.9, BoundingBox::new(10.0, 10.0, 90.0, 200.0).unwrap()).unwrap();
    let person = person.with_mask(Mask::filled(2, 2, true).unwrap());
    let error = builder.insert(&last.frame, &[person], &last.world_from_camera).unwrap_err();
    assert!(matches!(error, Error::Dynamics(_)), "{error}");

    // Neither maps nor tracks have noticed.
    let report = builder.insert(&last.frame, &last.detections, &last.world_from_camera).unwrap();
    let expected = undisturbed.insert(&last.frame, &last.detections, &last.world_from_camera).unwrap();
    assert_eq!(
        (report.movers, report.masked_pixels, report.outcome),
        (expected.movers, expected.masked_pixels, expected.outcome)
    );
    assert!(fingerprint(builder.map()) == fingerprint(undisturbed.map()));
}

/// Such a time was refused when it had been noted as the newest: no right one was taken any more.
#[test]
fn times_that_are_no_seconds_are_refused_before_anything_changes() {
    let frames: Vec<_> = sequence(2).frames().collect();
    let mut config = config();
    config.history = HistoryConfig::Memory;
    let mut builder = MapBuilder::new(config).unwrap();
    insert_all(&mut builder, &frames[..1]);
    let nanoseconds = 1.79e18;
    let SimulatedFrame { mut frame, world_from_camera: pose, .. } = frames[1].clone();
    frame.set_timestamp(nanoseconds).unwrap();
    for found in [Detections::NotRun, Detections::Pending] {
        let refused = builder.insert(&frame, found, &pose).unwrap_err();
        assert!(matches!(refused, Error::Dynamics(dymlm::dynamics::Error::Timestamp(1.79e18))), "{refused}");
    }
    assert!(builder.insert_scan(nanoseconds, &[[1.0, 0.0, 0.0]], &pose).is_err());
    assert_eq!(builder.trajectory().count(), 1);
    insert_all(&mut builder, &frames[1..]);
    assert_eq!(builder.trajectory().count(), 2);

    // Nor are those that the maps' clock does not reach when it goes on.
    let [first, last] = [frames[0].frame.timestamp(), 9e10].map(|time| {
        frame.set_timestamp(time).unwrap();
        frame.clone()
    });
    builder.insert(&last, Detections::NotRun, &pose).unwrap();
    builder.begin_session().unwrap();
    builder.insert(&first, Detections::NotRun, &pose).unwrap();
    assert!(builder.insert(&last, Detections::Pending, &pose).is_err());
    assert_eq!(builder.trajectory().count(), 4);
    assert_eq!(builder.process_waiting().unwrap().len(), 0);
}

/// A SLAM that begins anew gives its map points other ids: with those of the session before, an object would
/// share none of its points, and its voxels would never be looked at.
#[test]
fn ids_of_another_session_mean_other_points() {
    let frames: Vec<SimulatedFrame> = sequence(30).frames().step_by(5).collect();
    let mut builder = MapBuilder::new(config()).unwrap();
    let insert = |builder: &mut MapBuilder, simulated: &SimulatedFrame, first_id: u64| {
        let ids = simulated.detections.iter().zip(first_id..);
        let sighted: Vec<_> =
            ids.map(|(found, id)| SightedPoint::new(id, found.bounding_box().center())).collect();
        let input = FrameInput::new(&simulated.frame, &simulated.detections, &simulated.world_from_camera);
        let report = builder.insert_frame(&input.with_sighted_points(&sighted)).unwrap();
        let associated = &report.update().unwrap().objects.associated;
        associated.iter().filter_map(|pair| pair.tests.shared).collect::<Vec<f64>>()
    };
    for simulated in &frames[..4] {
        insert(&mut builder, simulated, 0);
    }
    builder.begin_session().unwrap();
    let shared = insert(&mut builder, &frames[4], 1000);
    assert!(shared.len() > 2 && shared.iter().all(|&shared| shared > 0.0), "{shared:?}");
}

#[test]
fn frames_that_are_no_key_frames_are_tracked_only() {
    let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).unwrap();
    let mut config = MapConfig::default();
    config.key_frames.min_translation = 0.1;
    config.key_frames.max_interval = 10.0;
    let mut builder = MapBuilder::new(config).unwrap();
    let mut mapped = Vec::new();
    for step in 0..6 {
        let depth = DepthImage::new(64, 48, vec![2.0; 64 * 48]).unwrap();
        let frame = Frame::new(f64::from(step) * 0.1, camera, depth, None).unwrap();
        let world_from_camera = Pose::new([0.04 * f64::from(step), 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
        let person = Detection::new("person", 0.9, BoundingBox::new(10.0, 5.0, 30.0, 48.0).unwrap()).unwrap();
        let report = builder.insert(&frame, &[person], &world_from_camera).unwrap();
        assert_eq!(report.movers.len(), 1);
        assert_eq!(report.movers[0].track_id, builder.preprocessor().movers()[0].track_id);
        mapped.push(report.update().is_some());
    }
    assert_eq!(mapped, [true, false, false, true, false, false]);
    assert_eq!(builder.map().cloud().frames(), 2);
}

#[test]
fn degenerate_frames_are_no_error() {
    let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).unwrap();
    let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
    for (step, value) in [0.0, f32::NAN, f32::INFINITY, 0.01, 1e30].into_iter().enumerate() {
        let frame =
            Frame::new(step as f64, camera, DepthImage::new(64, 48, vec![value; 64 * 48]).unwrap(), None)
                .unwrap();
        let everywhere = BoundingBox::new(-1e6, -1e6, 1e6, 1e6).unwrap();
        let nowhere = BoundingBox::new(700.0, 700.0, 700.0, 900.0).unwrap();
        let detections = [everywhere, nowhere].map(|b| Detection::new("person", 1.0, b).unwrap());
        let report = builder.insert(&frame, &detections, &Pose::identity()).unwrap();
        assert_eq!(report.update().unwrap().cloud.readings, 0);
    }
    assert!(builder.map().cloud().is_empty());
}

/// Regression: what was checked was the frame as it was given, and what the cloud refused was the one with
/// each second pixel, in which each reading stands for four: octree and planes had it, and the log had not.
#[test]
fn a_frame_that_looks_through_too_much_with_a_stride_changes_nothing() {
    let camera = PinholeCamera::new(64, 48, 32.0, 32.0, 31.5, 23.5).unwrap();
    let is_read = |pixel: usize| (pixel % 64).is_multiple_of(2) && (pixel / 64).is_multiple_of(2);
    let depths = (0..64 * 48).map(|pixel| if is_read(pixel) { 50.0 } else { 0.0 });
    let depth = DepthImage::new(64, 48, depths.collect()).unwrap();
    let frame = Frame::new(0.0, camera, depth, None).unwrap();
    let mut config = config();
    config.cloud.voxel_size = 0.01;
    (config.sensor.max_depth, config.sensor.stride) = (80.0, 2);
    config.history = HistoryConfig::Memory;
    let mut builder = MapBuilder::new(config).unwrap();
    let refused = builder.insert(&frame, Detections::NotRun, &Pose::identity());
    assert!(matches!(refused, Err(Error::Cloud(dymlm::cloud::Error::ViewTooLarge { .. }))), "{refused:?}");
    assert!(builder.trajectory().next().is_none() && builder.map().octree().is_empty());
}

#[test]
fn beyond_the_octree_the_other_maps_go_on() {
    let camera = fine_camera();
    let wall = DepthImage::new(320, 240, vec![2.0; 320 * 240]).unwrap();
    let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
    // The octree of 5 cm ends 1,638 m from the origin.
    let far = Pose::new([5000.0, 0.0, -1700.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    for step in 0..10 {
        let frame = Frame::new(f64::from(step) * 0.2, camera, wall.clone(), None).unwrap();
        let report = builder.insert(&frame, Detections::Found(&[]), &far).unwrap();
        let octree = report.update().unwrap().octree;
        assert_eq!((octree.readings, octree.outside), (320 * 240, 320 * 240));
    }
    let map = builder.map();
    assert!(map.cloud().len() > 10_000 && map.octree().is_empty());
    assert_eq!(map.planes().iter().count(), 1);
}

#[test]
fn the_report_names_planes_that_did_not_reach_the_map() {
    let camera = fine_camera();
    let wall = DepthImage::new(320, 240, vec![2.0; 320 * 240]).unwrap();
    let wall = Frame::new(0.0, camera, wall, None).unwrap();
    let mut config = config();
    config.planes.detector.min_area = 50.0;
    let mut builder = MapBuilder::new(config).unwrap();
    let report = builder.insert(&wall, &[], &Pose::identity()).unwrap();
    let update = report.update().unwrap();
    assert!(update.planes.created.is_empty() && builder.map().planes().candidates().count() == 0);
    let causes: Vec<_> = update.planes.rejected.iter().map(|plane| plane.cause).collect();
    assert!(matches!(causes[..], [RejectionCause::Area { .. }]), "{causes:?}");
}

#[test]
fn the_report_times_each_step() {
    let frames: Vec<SimulatedFrame> = sequence(2).frames().collect();
    let mut builder = MapBuilder::new(config()).unwrap();
    insert_all(&mut builder, &frames[..1]);
    let last = &frames[1];
    let report = builder.insert(&last.frame, &last.detections, &last.world_from_camera).unwrap();
    assert!(report.stages.of(Stage::Cloud) > std::time::Duration::ZERO);
    // Steps may run beside each other.
    assert!(Stage::ALL.iter().all(|&stage| report.stages.of(stage) <= report.stages.total()));
}

#[test]
fn frames_that_wait_for_their_detections_give_the_same_maps() {
    let frames: Vec<SimulatedFrame> = sequence(12).frames().collect();
    let mut at_once = MapBuilder::new(config()).unwrap();
    insert_all(&mut at_once, &frames);

    // The detector takes the time of three frames, and the second frame's result comes last of the first
    // three.
    let mut patient = config();
    patient.max_detection_delay = 10.0;
    let mut late = MapBuilder::new(patient).unwrap();
    let mut ids = Vec::new();
    let mut mapped = Vec::new();
    let mut note = |report: dymlm::FrameReport| {
        let reports = report.released.iter().chain([&report]);
        let done = reports.filter(|report| report.outcome != FrameOutcome::Waiting);
        let mut done: Vec<_> = done.map(|report| report.id).collect();
        done.sort_unstable();
        mapped.extend(done);
    };
    let answer_order = [0, 2, 1, 3, 4, 5, 6, 7, 8, 9, 10, 11];
    for (index, frame) in frames.iter().enumerate() {
        let report = late.insert(&frame.frame, Detections::Pending, &frame.world_from_camera).unwrap();
        assert_eq!(report.outcome, FrameOutcome::Waiting);
        ids.push(report.id);
        note(report);
        if index >= 3 {
            let answered = answer_order[index - 3];
            note(late.detections_for(ids[answered], &frames[answered].detections).unwrap());
        }
    }
    for answered in &answer_order[9..] {
        note(late.detections_for(ids[*answered], &frames[*answered].detections).unwrap());
    }
    assert_eq!(mapped, ids, "in the order of time");
    assert!(fingerprint(late.map()) == fingerprint(at_once.map()));
    assert!(matches!(late.detections_for(ids[0], &[]), Err(Error::NotPending { .. })));
}

#[test]
fn a_frame_whose_detections_come_too_late_is_mapped_without() {
    let frames: Vec<SimulatedFrame> = sequence(5).frames().collect();
    let mut config = config();
    config.max_detection_delay = 1.5 * (frames[1].frame.timestamp() - frames[0].frame.timestamp());
    let (mut waited, mut not_run) =
        (MapBuilder::new(config.clone()).unwrap(), MapBuilder::new(config).unwrap());
    let mut first = None;
    for (index, frame) in frames.iter().enumerate() {
        let found = if index == 0 { Detections::Pending } else { Detections::from(&frame.detections) };
        let report = waited.insert(&frame.frame, found, &frame.world_from_camera).unwrap();
        assert_eq!(report.outcome == FrameOutcome::Waiting, index < 2, "{index}");
        assert_eq!(report.released.len(), if index == 2 { 2 } else { 0 });
        first.get_or_insert(report.id);

        let found = if index == 0 { Detections::NotRun } else { Detections::from(&frame.detections) };
        not_run.insert(&frame.frame, found, &frame.world_from_camera).unwrap();
    }
    assert!(matches!(waited.detections_for(first.unwrap(), &[]), Err(Error::NotPending { .. })));
    assert!(fingerprint(waited.map()) == fingerprint(not_run.map()));
}

/// The detector is done before the next frame, and what it found is fetched after that frame was inserted.
#[test]
fn where_frames_come_once_a_second_a_detector_one_frame_behind_is_heard() {
    let mut frames: Vec<SimulatedFrame> = sequence(4).frames().collect();
    for (second, one) in frames.iter_mut().enumerate() {
        one.frame.set_timestamp(second as f64).unwrap();
    }
    let (mut behind, mut at_once) = (MapBuilder::new(config()).unwrap(), MapBuilder::new(config()).unwrap());
    let mut last = None;
    for one in &frames {
        let id = behind.insert(&one.frame, Detections::Pending, &one.world_from_camera).unwrap().id;
        if let Some((before, found)) = last.replace((id, &one.detections)) {
            behind.detections_for(before, found).unwrap();
        }
        at_once.insert(&one.frame, &one.detections, &one.world_from_camera).unwrap();
    }
    let (newest, found) = last.unwrap();
    behind.detections_for(newest, found).unwrap();
    assert!(fingerprint(behind.map()) == fingerprint(at_once.map()));
}

#[test]
fn what_waits_is_refused_at_its_insertion_or_never() {
    let frames: Vec<SimulatedFrame> = sequence(3).frames().collect();
    let mut builder = MapBuilder::new(config()).unwrap();
    let newest = &frames[2];
    let waiting = builder.insert(&newest.frame, Detections::Pending, &newest.world_from_camera).unwrap();
    // Older than the frame that waits.
    let early = &frames[0];
    assert!(builder.insert(&early.frame, &early.detections, &early.world_from_camera).is_err());
    // A mask of another size, when the detections come; the frame goes on waiting.
    let person = Detection::new("person", 0.9, BoundingBox::new(10.0, 10.0, 90.0, 200.0).unwrap()).unwrap();
    let person = person.with_mask(Mask::filled(2, 2, true).unwrap());
    assert!(matches!(builder.detections_for(waiting.id, &[person]), Err(Error::Dynamics(_))));
    assert_eq!(builder.process_waiting().unwrap().len(), 1);
    assert_eq!(builder.map().cloud().frames(), 1);
}

#[test]
fn a_stride_maps_what_a_camera_of_fewer_pixels_would_have() {
    let frames: Vec<SimulatedFrame> = sequence(3).frames().collect();
    let mut with_stride = config();
    with_stride.sensor.stride = 2;
    let mut with_stride = MapBuilder::new(with_stride).unwrap();
    let mut small = MapBuilder::new(config()).unwrap();
    for frame in &frames {
        let half = frame.frame.subsampled(2).unwrap();
        let detections: Vec<Detection> = frame.detections.iter().map(|found| found.subsampled(2)).collect();
        let report = with_stride.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
        let expected = small.insert(&half, &detections, &frame.world_from_camera).unwrap();
        assert_eq!(report.outcome, expected.outcome);
        assert_eq!(report.masked_pixels, 4 * expected.masked_pixels);
        for (mover, expected) in report.movers.iter().zip(&expected.movers) {
            assert_eq!(mover.bounding_box, expected.bounding_box.upsampled(2), "in the caller's pixels");
        }
    }
    assert!(fingerprint(with_stride.map()) == fingerprint(small.map()));
}

#[test]
fn a_camera_at_rest_adds_five_frames_a_second_and_memory_stays() {
    let camera = PinholeCamera::new(64, 48, 52.5, 52.5, 31.5, 23.5).unwrap();
    let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
    let stand = |seconds: std::ops::Range<u32>, builder: &mut MapBuilder| {
        for step in seconds.start * 30..seconds.end * 30 {
            // A person in every sixth second, and a chair beside.
            let walks = step / 30 % 6 == 0;
            let depth = (0..64 * 48).map(|pixel| match pixel % 64 {
                10..20 if walks => 1.5,
                30..40 if pixel / 64 > 24 => 1.9,
                _ => 2.0 + 0.002 * ((pixel * 31 + step as usize * 7919) % 11) as f32,
            });
            let depth = DepthImage::new(64, 48, depth.collect()).unwrap();
            let frame = Frame::new(f64::from(step) / 30.0, camera, depth, None).unwrap();
            let person = BoundingBox::new(9.0, 0.0, 21.0, 48.0).unwrap();
            let chair = Detection::new("chair", 0.9, BoundingBox::new(29.0, 24.0, 41.0, 48.0).unwrap());
            let person = walks.then(|| Detection::new("person", 0.9, person).unwrap());
            let found: Vec<Detection> = person.into_iter().chain(chair).collect();
            builder.insert(&frame, &found, &Pose::identity()).unwrap();
        }
    };
    stand(0..30, &mut builder);
    assert!((145..=155).contains(&builder.map().cloud().frames()), "{}", builder.map().cloud().frames());
    let before = builder.map().memory();
    stand(30..90, &mut builder);
    let after = builder.map().memory();
    assert_eq!((before.octree, before.objects), (after.octree, after.objects));
    let key_frames = 5 * 60;
    assert!(after.planes - before.planes < 2048 * key_frames, "{before:?} {after:?}");
    // Sums and counts get wider; the evidence is kept by 1.5 periods for each doubling of time.
    assert!(after.cloud < 2 * before.cloud, "{before:?} {after:?}");
}

#[test]
fn what_is_far_is_forgotten_in_all_maps() {
    let frames: Vec<SimulatedFrame> = sequence(18).frames().collect();
    let mut builder = MapBuilder::new(config()).unwrap();
    insert_all(&mut builder, &frames[..12]);
    let place = frames[0].world_from_camera.transform_point([0.0, 0.0, 2.0]);
    let (before, all) = (builder.map().memory(), fingerprint(builder.map()));
    builder.forget_outside(place, 100.0);
    assert!(fingerprint(builder.map()) == all, "nothing is that far");

    builder.forget_outside(place, 1.0);
    let map = builder.map();
    let after = map.memory();
    assert!(after.cloud < before.cloud && after.planes <= before.planes, "{before:?} {after:?}");
    let distance = |point: [f64; 3]| difference(point, place).iter().map(|c| c * c).sum::<f64>().sqrt();
    let cloud = map.cloud().point_cloud(Selection::Static);
    assert!(!cloud.is_empty());
    assert!(cloud.points().iter().all(|point| distance(point.map(f64::from)) < 1.6));
    let leaves = map.octree().leaves().filter(|leaf| leaf.size < 0.06);
    assert!(leaves.into_iter().all(|leaf| distance(leaf.center) < 1.8));
    assert!(map.objects().objects().all(|object| distance(object.oriented_box().center()) <= 1.0));

    // Mapping goes on.
    insert_all(&mut builder, &frames[12..]);
    assert!(builder.map().cloud().len() > cloud.len());
}
