//! How a SLAM system feeds `dymlm`: frames, detections and poses in, maps out.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]

use dymlm::core::{BoundingBox, ColorImage, DepthImage, Detection, Frame, PinholeCamera, Pose};
use dymlm::octree::UnknownCells;
use dymlm::{MapBuilder, MapConfig, Selection};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let camera = PinholeCamera::new(640, 480, 525.0, 525.0, 319.5, 239.5)?;
    let mut builder = MapBuilder::new(MapConfig::default())?;

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
        println!("{:.2} s: {} movers, {:.1?}", report.timestamp, report.movers.len(), report.stages.total());
    }

    // Your planner: read the maps whenever you need them.
    let cloud = builder.map().cloud().point_cloud(Selection::Static);
    let ahead = builder.map().octree().cast_ray([0.0, 0.0, 1.2], [0.0, 0.0, 1.0], 5.0, UnknownCells::Stop);
    println!("{} points; the ray ahead ends at {:?}", cloud.len(), ahead);
    Ok(())
}
