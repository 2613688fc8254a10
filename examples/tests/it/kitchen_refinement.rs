//! How thick the surfaces of a real kitchen are in the plane map before and after its poses are refined: with the
//! recording's own poses, which come from a fusion system, and with poses that drift.
//!
//! `cargo test -p dymlm-examples --test it -- --ignored --nocapture kitchen_refinement` prints both. The rendered
//! counterparts, whose truth is exact, are the sequences of `evaluate --pose-noise --refine`.
use std::path::Path;

use dymlm::core::{PlaneId, Pose};
use dymlm::planes::PlaneMap;
use dymlm::{HistoryConfig, MapBuilder, MapConfig, RefineConfig};
use dymlm_examples::FrameSource;
use dymlm_io::TumOptions;
use dymlm_sim::{PoseErrorConfig, RecordedDrift, Sequence, SequenceConfig};
use dymlm_test_support::recording;

use crate::kitchen_planes::SURFACES;

#[test]
#[ignore = "a minute"]
fn refined_poses_make_surfaces_thinner() {
    let Some(folder) = recording("kitchen") else { return };
    let own = Thicknesses::of(&folder, |poses| poses);
    let drifting = Thicknesses::of(&folder, |poses| drift_of_slam().on_path(&poses));
    let columns = [&own.before, &own.after, &drifting.before, &drifting.after];

    println!("thickness, mm: own poses, refined; drifting poses, refined");
    for (index, surface) in SURFACES.iter().enumerate() {
        let [before, after, drifted, refined] = columns.map(|thicknesses| thicknesses[index]);
        println!("{:>10}: {before:5.1} {after:5.1}; {drifted:5.1} {refined:5.1}", surface.name);
        assert!(after < before && refined < drifted, "{}", surface.name);
    }
    let [before, after, drifted, refined] = columns.map(|thicknesses| thicknesses.iter().sum::<f64>());
    println!("{:>10}: {before:5.1} {after:5.1}; {drifted:5.1} {refined:5.1}", "sum");
    assert!(refined < before, "{refined} mm refined, {before} mm with the recording's own poses");
}

/// The thickness of each surface: the root mean square of the distances of its readings from its plane, millimetres.
struct Thicknesses {
    before: Vec<f64>,
    after: Vec<f64>,
}

impl Thicknesses {
    fn of(folder: &Path, change: impl Fn(Vec<Pose>) -> Vec<Pose>) -> Self {
        let mut options = TumOptions::default();
        options.every = 2;
        let mut source = FrameSource::recorded(folder, None, &options).unwrap();
        let poses: Vec<Pose> = (0..source.len()).map(|index| source.pose(index).unwrap()).collect();
        let mut config = MapConfig::default();
        // Cloud and octree are not looked at, so they may be coarse.
        config.cloud.voxel_size = 0.04;
        config.octree.resolution = 0.2;
        config.history = HistoryConfig::Memory;
        let mut builder = MapBuilder::new(config).unwrap();
        for (index, pose) in change(poses).iter().enumerate() {
            let frame = source.load(index).unwrap();
            builder.insert(&frame.frame, frame.detections.as_deref(), pose).unwrap();
            source.recycle(frame);
        }
        let surfaces: Vec<PlaneId> = surfaces(builder.map().planes());
        let thicknesses = |planes: &PlaneMap| {
            surfaces.iter().map(|&id| 1e3 * planes.plane(id).unwrap().mse().sqrt()).collect()
        };
        let before = thicknesses(builder.map().planes());
        builder.refine_poses(&RefineConfig::default()).unwrap();
        Self { before, after: thicknesses(builder.map().planes()) }
    }
}

/// The largest plane of each surface.
fn surfaces(planes: &PlaneMap) -> Vec<PlaneId> {
    let largest = SURFACES.iter().map(|surface| {
        let parts = planes.iter().filter(|plane| surface.has(plane));
        parts.max_by(|a, b| a.area().total_cmp(&b.area())).unwrap().id()
    });
    largest.collect()
}

/// The errors of a SLAM among walking people, as a function of the way.
fn drift_of_slam() -> RecordedDrift {
    let mut config = SequenceConfig::default();
    config.pose_error = PoseErrorConfig::slam();
    let sequence = Sequence::new(&config).unwrap();
    let exact: Vec<Pose> = (0..sequence.len()).map(|index| sequence.world_from_camera(index)).collect();
    let estimated: Vec<Pose> = (0..sequence.len()).map(|index| sequence.estimated_pose(index)).collect();
    RecordedDrift::new(&exact, &estimated).unwrap()
}
