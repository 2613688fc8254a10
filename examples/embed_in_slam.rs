//! How a SLAM system uses `dymlm`: frames, detections and poses in, maps out; the maps follow a loop closure.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use dymlm::core::{BoundingBox, ColorImage, DepthImage, Detection, Frame, FrameId, PinholeCamera, Pose};
use dymlm::octree::UnknownCells;
use dymlm::{HistoryConfig, MapBuilder, MapConfig, Selection};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5)?;
    let mut config = MapConfig::default();
    // Only for a SLAM that closes loops: the observations of key frames are kept, to be mapped again.
    config.history = HistoryConfig::Memory;
    let mut builder = MapBuilder::new(config)?;
    let mut mapped: Vec<(FrameId, Pose)> = Vec::new();

    for k in 0..30 {
        // Your camera: depth as stored (here millimetres), colour registered to it.
        let depth = DepthImage::from_u16(640, 480, &vec![2000; 640 * 480], 1000.0)?;
        let color = ColorImage::new(640, 480, vec![[180, 170, 160]; 640 * 480])?;
        let frame = Frame::new(f64::from(k) / 30.0, camera, depth, Some(color))?;
        // Your detector.
        let detections = [Detection::new("person", 0.83, BoundingBox::new(200.0, 40.0, 320.0, 480.0)?)?];
        // Your tracker: takes camera coordinates to the world (x y z, quaternion x y z w).
        let world_from_camera = Pose::new([0.01 * f64::from(k), 0.0, 1.2], [0.0, 0.0, 0.0, 1.0])?;

        let report = builder.insert(&frame, &detections, &world_from_camera)?;
        mapped.push((report.id, world_from_camera));
        println!("{:.2} s: {} movers, {:.1?}", report.timestamp, report.movers.len(), report.stages.total());
    }

    // Your back end has closed a loop: give new poses for any of the frames; the others move with them.
    let optimized: Vec<(FrameId, Pose)> =
        mapped.iter().map(|&(id, pose)| (id, moved_back(id, pose))).collect();
    let report = builder.correct_poses(&optimized)?;
    println!("{} of {} key frames moved", report.moved_key_frames, report.key_frames);

    // Your planner: read the maps whenever you need them.
    let cloud = builder.map().cloud().point_cloud(Selection::Static);
    let ahead = builder.map().octree().cast_ray([0.0, 0.0, 1.2], [0.0, 0.0, 1.0], 5.0, UnknownCells::Stop);
    println!("{} points; the ray ahead ends at {:?}", cloud.len(), ahead);
    Ok(())
}

/// A correction as a back end may find it: drift that had grown with each frame.
fn moved_back(frame: FrameId, drifted: Pose) -> Pose {
    Pose::new([-0.001 * frame.get() as f64, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
        .map_or(drifted, |back| back * drifted)
}
