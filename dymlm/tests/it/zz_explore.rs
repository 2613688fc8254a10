use dymlm::{HistoryConfig, MapBuilder, MapConfig, RefineConfig};
use dymlm_core::Pose;
use dymlm_metrics::TrajectoryScore;
use dymlm_sim::{Sequence, SequenceConfig, Room, PoseErrorConfig};

#[test]
fn explore() {
    for (seed, room) in [(1, 0), (2, 1), (3, 1), (4, 1), (5, 0), (6, 1), (7, 2), (8, 2)] {
        let mut config = if room == 2 { SequenceConfig::building(seed, 2) } else { SequenceConfig::default() };
        if room < 2 { (config.seed, config.frames) = (seed, 300); }
        if room == 1 { config.room = Room::Random; }
        config.pose_error = PoseErrorConfig::slam();
        config.camera = dymlm_core::PinholeCamera::new(160, 120, 131.0, 131.0, 79.5, 59.5).ok();
        let sequence = Sequence::new(&config).unwrap();
        let mut map = MapConfig::default();
        map.cloud.voxel_size = 0.03;
        map.history = HistoryConfig::Memory;
        let mut builder = MapBuilder::new(map).unwrap();
        for (index, simulated) in sequence.frames().enumerate().step_by(3) {
            builder.insert(&simulated.frame, &simulated.detections, &sequence.estimated_pose(index)).unwrap();
        }
        builder.settle();
        let error = |builder: &MapBuilder| {
            let poses: Vec<Pose> = builder.trajectory().map(|(_, _, pose)| pose).collect();
            let truth: Vec<Pose> = (0..poses.len()).map(|index| sequence.world_from_camera(3 * index)).collect();
            let score = TrajectoryScore::of(&poses, &truth).unwrap();
            (1e3 * score.translation, score.rotation.to_degrees())
        };
        let before = error(&builder);
        let report = builder.refine_poses(&RefineConfig::default()).unwrap();
        let (t, r) = error(&builder);
        println!("E {seed} {room} before {:.2} mm {:.3} deg after {t:.2} mm {r:.3} deg objects {} views {} left {} unheld {} rounds {}", before.0, before.1, report.found.objects, report.found.object_views, report.found.object_views_left_out, report.found.unheld.len(), report.costs.len());
    }
}
