//! Poses that are refined by planes.
#![cfg(feature = "refine")]
use std::collections::{BTreeMap, BTreeSet};

use dymlm::planes::MapPlane;
use dymlm::{
    Error, HistoryConfig, LoopClosure, MapBuilder, MapConfig, MultiLevelMap, RefineConfig, ThingChanges,
};
use dymlm_core::{FrameId, ObjectId, PinholeCamera, PlaneId, Pose};
use dymlm_metrics::TrajectoryScore;
use dymlm_sim::{PoseErrorConfig, SensorConfig, Sequence, SequenceConfig};
use dymlm_test_support::{Cuboid, Rectangle, World, look_at};

/// A sequence whose poses drift as a SLAM's do, with small images.
fn drifting(seed: u64, frames: usize) -> Sequence {
    let mut config = SequenceConfig::default();
    (config.seed, config.frames) = (seed, frames);
    config.camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).ok();
    config.pose_error = PoseErrorConfig::slam();
    Sequence::new(&config).unwrap()
}

fn config() -> MapConfig {
    let mut config = MapConfig::default();
    // Poses are refined by planes and objects, whatever the cloud and the octree are like.
    (config.cloud.voxel_size, config.octree.resolution) = (0.06, 0.1);
    config.history = HistoryConfig::Memory;
    config
}

/// Every third frame, mapped at its drifting pose.
fn mapped(sequence: &Sequence) -> MapBuilder {
    let mut builder = MapBuilder::new(config()).unwrap();
    for (index, simulated) in sequence.frames().enumerate().step_by(3) {
        builder.insert(&simulated.frame, &simulated.detections, &sequence.estimated_pose(index)).unwrap();
    }
    builder.settle();
    builder
}

/// Root mean square of the distances between the frames' poses in the maps and the true ones, metres.
fn error(builder: &MapBuilder, sequence: &Sequence) -> f64 {
    let poses: Vec<Pose> = builder.trajectory().map(|(_, _, pose)| pose).collect();
    let truth: Vec<Pose> = (0..poses.len()).map(|index| sequence.world_from_camera(3 * index)).collect();
    TrajectoryScore::of(&poses, &truth).unwrap().translation
}

/// Views of planes were refused whose points lie exactly in one plane.
#[test]
fn poses_of_a_camera_without_noise_are_refined_as_well() {
    let mut config = drifting(4, 60).config().clone();
    config.sensor = SensorConfig::ideal();
    let mut builder = mapped(&Sequence::new(&config).unwrap());
    assert!(builder.refine_poses(&RefineConfig::default()).is_ok());
}

#[test]
fn planes_take_out_drift() {
    let sequence = drifting(1, 300);
    let mut builder = mapped(&sequence);
    let before = error(&builder, &sequence);
    let report = builder.refine_poses(&RefineConfig::default()).unwrap();
    let after = error(&builder, &sequence);
    assert!(after < 0.4 * before && after < 0.01, "{before} m before, {after} m after");
    let first = report.costs[0];
    assert!(first[1] < 0.2 * first[0], "{:?}", report.costs);
    assert!(report.found.planes > 6 && report.found.views > 300 && report.correction.key_frames == 100);
    assert_eq!(report.found.parted, 0);
}

/// Rooms that are met again when the poses have drifted further than planes are associated.
#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn planes_that_are_met_again_are_one() {
    let mut building = SequenceConfig::building(7, 2);
    building.camera = PinholeCamera::new(112, 84, 91.7, 91.7, 55.5, 41.5).ok();
    building.pose_error = PoseErrorConfig::slam();
    let sequence = Sequence::new(&building).unwrap();
    let mut builder = mapped(&sequence);
    let before = error(&builder, &sequence);
    assert!(builder.map().refined_poses(&RefineConfig::default(), &[]).unwrap().met_again > 3);
    let poses = |builder: &MapBuilder| builder.trajectory().map(|(_, _, pose)| pose).collect::<Vec<Pose>>();
    let (old, planes, objects) = (poses(&builder), planes_of(builder.map()), objects_of(builder.map()));
    let report = builder.refine_poses(&RefineConfig::default()).unwrap();
    let after = error(&builder, &sequence);
    assert!(after < 0.25 * before, "{before} m before, {after} m after");
    assert!((2..4).contains(&report.costs.len()), "{:?}", report.costs);

    // The correction that is reported is that of all rounds.
    let (new, correction) = (poses(&builder), &report.correction);
    let followed = correction.new_from_old * *old.last().unwrap();
    let newest = new.last().unwrap();
    assert!(followed.distance(newest) < 1e-9 && followed.angle(newest) < 1e-9, "{correction:?}");
    let motions = old.iter().zip(&new).map(|(old, new)| old.distance(new));
    let largest = motions.fold(0.0, f64::max);
    assert!(correction.largest_motion >= largest, "{} m of {largest} m", correction.largest_motion);
    assert!(correction.moved_key_frames <= correction.key_frames);
    assert_changed(&planes, &planes_of(builder.map()), &correction.planes);
    assert_changed(&objects, &objects_of(builder.map()), &correction.objects);
}

fn planes_of(map: &MultiLevelMap) -> BTreeMap<PlaneId, [f64; 3]> {
    map.planes().iter().map(|plane| (plane.id(), plane.centroid())).collect()
}

fn objects_of(map: &MultiLevelMap) -> BTreeMap<ObjectId, [f64; 3]> {
    map.objects().objects().map(|object| (object.id(), object.oriented_box().center())).collect()
}

/// What was there before leads, by the changes that are reported, to what is there now.
fn assert_changed<Id: Ord + Copy + std::fmt::Debug>(
    before: &BTreeMap<Id, [f64; 3]>,
    now: &BTreeMap<Id, [f64; 3]>,
    changes: &ThingChanges<Id>,
) {
    let gone: BTreeSet<Id> =
        changes.merged.iter().map(|(id, _)| *id).chain(changes.vanished.iter().copied()).collect();
    let new: BTreeSet<Id> =
        changes.split.iter().map(|(_, part)| *part).chain(changes.appeared.iter().copied()).collect();
    assert!(before.keys().filter(|id| !now.contains_key(id)).eq(&gone), "{changes:?}");
    assert!(now.keys().filter(|id| !before.contains_key(id)).eq(&new), "{changes:?}");
    let motion = |(&id, place): (&Id, &[f64; 3])| {
        let new = now.get(&id)?;
        let distance = (0..3).map(|i| (new[i] - place[i]).powi(2)).sum::<f64>().sqrt();
        (distance > 0.0).then_some((id, distance))
    };
    let moved: Vec<(Id, f64)> = before.iter().filter_map(motion).collect();
    let reported = changes.moved.iter().map(|moved| (moved.id, moved.distance));
    let same = |((a, far), (b, reported)): (&(Id, f64), (Id, f64))| *a == b && (far - reported).abs() < 1e-9;
    assert!(
        moved.len() == changes.moved.len() && moved.iter().zip(reported).all(same),
        "{moved:?} {changes:?}"
    );
}

/// Of three loop closures the wrong one is named. Their frames need not be key frames.
#[test]
fn wrong_loop_closures_are_left_out() {
    let sequence = drifting(5, 120);
    let mut builder = mapped(&sequence);
    let closure = |from: usize, to: usize, error: f64| LoopClosure {
        from: FrameId::new(from as u64),
        to: FrameId::new(to as u64),
        from_from_to: Pose::new([error, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap()
            * sequence.world_from_camera(3 * from).inverse()
            * sequence.world_from_camera(3 * to),
        rotation_deviation: 0.005,
        translation_deviation: 0.01,
    };
    let mut unknown = closure(0, 3, 0.0);
    unknown.to = FrameId::new(999);
    let config = RefineConfig::default();
    assert!(matches!(builder.refine_poses_with(&config, &[unknown]), Err(Error::UnknownFrame { .. })));
    let closures = [closure(0, 38, 0.0), closure(2, 30, 0.5), closure(5, 37, 0.0)];
    let report = builder.refine_poses_with(&config, &closures).unwrap();
    assert_eq!(report.found.left_out, [1]);
    let after = error(&builder, &sequence);
    assert!(after < 0.01, "{after} m");
}

/// Regression: one closure between frames of one key frame refused all of them, with a number that the caller
/// did not know, and so did one with a deviation of 0.
#[test]
fn closures_within_a_key_frame_say_nothing_and_wrong_deviations_are_named() {
    let sequence = drifting(5, 120);
    let mut builder = mapped(&sequence);
    let closure = |from: u64, to: u64, from_from_to: Pose| LoopClosure {
        from: FrameId::new(from),
        to: FrameId::new(to),
        from_from_to,
        rotation_deviation: 0.005,
        translation_deviation: 0.01,
    };
    let wrong = Pose::new([0.5, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap();
    let scan = builder.insert_scan(11.9, &[[2.0, 0.0, 0.5]], &sequence.estimated_pose(117)).unwrap().id;
    let closures = [closure(4, 4, wrong), closure(2, 30, wrong), closure(39, scan.get(), wrong)];
    let config = RefineConfig::default();
    let before = error(&builder, &sequence);
    let report = builder.refine_poses_with(&config, &closures).unwrap();
    assert_eq!(report.found.left_out, [1]);
    assert!(error(&builder, &sequence) < before);

    for (rotation, translation) in [(0.0, 0.01), (0.005, -0.01), (f64::NAN, 0.01), (0.005, 1e-200)] {
        let mut refused = closure(2, 30, wrong);
        (refused.rotation_deviation, refused.translation_deviation) = (rotation, translation);
        let result = builder.refine_poses_with(&config, &[closures[0], refused]);
        assert!(matches!(result, Err(Error::LoopClosureDeviations { closure: 1, .. })), "{result:?}");
    }
}

#[test]
fn a_closure_between_scans_is_refused() {
    let mut builder = MapBuilder::new(config()).unwrap();
    for second in 0..2 {
        builder.insert_scan(second.into(), &[[2.0, 0.0, 0.5]], &Pose::identity()).unwrap();
    }
    let closure = LoopClosure {
        from: FrameId::new(0),
        to: FrameId::new(1),
        from_from_to: Pose::identity(),
        rotation_deviation: 0.005,
        translation_deviation: 0.01,
    };
    let refused = builder.refine_poses_with(&RefineConfig::default(), &[closure]);
    assert!(matches!(refused, Err(Error::NoKeyFrames)), "{refused:?}");
}

/// Poses that are true are no worse afterwards than the sensor's noise makes them.
#[test]
fn true_poses_stay() {
    let sequence = drifting(4, 150);
    let mut builder = MapBuilder::new(config()).unwrap();
    for simulated in sequence.frames().step_by(3) {
        builder.insert(&simulated.frame, &simulated.detections, &simulated.world_from_camera).unwrap();
    }
    builder.settle();
    builder.refine_poses(&RefineConfig::default()).unwrap();
    let after = error(&builder, &sequence);
    assert!(after < 0.005, "{after} m");
}

#[test]
fn a_wrong_config_is_refused() {
    let mut builder = MapBuilder::new(config()).unwrap();
    let mut wrong = RefineConfig::default();
    wrong.rounds = 0;
    assert!(matches!(builder.refine_poses(&wrong), Err(Error::Config(_))));
    // And without a frame there is nothing to do.
    let report = builder.refine_poses(&RefineConfig::default()).unwrap();
    assert_eq!((report.found.planes, report.found.views), (0, 0));
}

#[test]
fn without_a_history_nothing_is_refined() {
    let mut builder = MapBuilder::new(MapConfig::default()).unwrap();
    assert!(matches!(builder.refine_poses(&RefineConfig::default()), Err(Error::NoHistory)));
}

/// Of a second session that was put a hand's breadth beside the first, in the same room.
#[test]
#[ignore = "ten seconds: .ci/nightly"]
fn a_session_that_was_put_beside_the_first_is_brought_to_it() {
    let sequence = drifting(6, 240);
    let mut builder = MapBuilder::new(config()).unwrap();
    let shift = Pose::new([0.03, 0.02, 0.025], [0.0, 0.0, 0.0, 1.0]).unwrap();
    for (index, simulated) in sequence.frames().enumerate().step_by(3) {
        if index == 120 {
            builder.begin_session().unwrap();
        }
        let pose = simulated.world_from_camera;
        let pose = if index < 120 { pose } else { shift * pose };
        builder.insert(&simulated.frame, &simulated.detections, &pose).unwrap();
    }
    builder.settle();
    let before = error(&builder, &sequence);
    builder.refine_poses(&RefineConfig::default()).unwrap();
    let after = error(&builder, &sequence);
    assert!(after < 0.4 * before && after < 0.008, "{before} m before, {after} m after");
}

/// A wall, and past its end a panel 8 cm before it. The camera looks at the wall, walks on while it looks down
/// at the benches, and looks at the panel: meanwhile its poses have drifted by 8 cm, so that the map takes
/// both for one plane. The benches and what is known of drift say otherwise.
#[test]
fn a_plane_that_was_wrongly_merged_is_parted() {
    const STEP: f64 = 0.08;
    let bench = |y: f64, height: f64| Cuboid {
        world_from_cuboid: Pose::new([0.5, y, 0.5 * height], [0.0, 0.0, 0.0, 1.0]).unwrap(),
        lengths: [11.0, 0.3, height],
    };
    let mut world = World::of(&[
        Rectangle::level([0.5, 0.0, 0.0], 6.0, 4.0),
        Rectangle::upright([-2.0, 3.0, 1.5], 3.0, 1.5),
        Rectangle::upright([3.5, 3.0 - STEP, 1.5], 2.5, 1.5),
    ]);
    world.cuboids = vec![bench(1.15, 0.45), bench(2.05, 0.9)];
    let camera = PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).unwrap();
    let mut builder = MapBuilder::new(config()).unwrap();
    let mut truth = Vec::new();
    for index in 0..40_u32 {
        let x = -3.52 + 0.22 * f64::from(index);
        let is_walking = (-1.31..3.27).contains(&x);
        let target = if is_walking { [x, 1.0, 0.0] } else { [x, 3.0, 0.9] };
        let pose = look_at([x, -0.8, 1.4], target);
        let frame = world.frame(camera, &pose, index.into());
        let drift = STEP * ((x + 1.5) / 5.0).clamp(0.0, 1.0);
        let drifted = Pose::new([0.0, drift, 0.0], [0.0, 0.0, 0.0, 1.0]).unwrap() * pose;
        builder.insert(&frame, &[], &drifted).unwrap();
        truth.push(pose);
    }
    builder.settle();
    let [wall, panel] = [[-2.0, 3.0, 1.0], [3.5, 3.0 - STEP, 1.0]];
    let plane_at = |builder: &MapBuilder, place: [f64; 3]| {
        let planes = builder.map().planes();
        let near =
            |plane: &&MapPlane| plane.plane().signed_distance(place).abs() < 0.02 && plane.holds(place);
        planes.iter().find(near).map(MapPlane::id)
    };
    // At these poses the panel is where the wall would go on.
    let seen_panel = [panel[0], panel[1] + STEP, panel[2]];
    assert!(plane_at(&builder, wall).is_some());
    assert_eq!(plane_at(&builder, wall), plane_at(&builder, seen_panel));

    assert_eq!(builder.map().refined_poses(&RefineConfig::default(), &[]).unwrap().parted, 1);
    builder.refine_poses(&RefineConfig::default()).unwrap();
    let [wall, panel] = [wall, panel].map(|place| plane_at(&builder, place));
    assert!(wall.is_some() && panel.is_some() && wall != panel, "{wall:?} {panel:?}");
    let poses: Vec<Pose> = builder.trajectory().map(|(_, _, pose)| pose).collect();
    let after = TrajectoryScore::of(&poses, &truth).unwrap().translation;
    assert!(after < 0.05 * STEP, "{after} m");
}
