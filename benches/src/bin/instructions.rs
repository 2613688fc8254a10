//! One run of each of the main operations in its steady state, for `.ci/instructions`, which counts their
//! instructions: a processor's noise does not touch these, so that a change of a few per cent shows.
//!
//! `instructions` prints the names, `instructions NAME` prepares an operation and runs it once. Inputs are
//! seeded.

#![allow(clippy::print_stdout, reason = "a program for the terminal")]
#![allow(clippy::unnecessary_wraps, reason = "all operations have one type")]

use std::error::Error;
use std::hint::black_box;

use dymlm::{MapBuilder, MapConfig};
use dymlm_benches::{SEED, blobs, footprint, kinect, room_depth, thing};
use dymlm_cloud::{CloudMap, CloudMapConfig, Selection};
use dymlm_core::{BoundingBox, Detection, Frame, PointCloud, Pose, SensorModel};
use dymlm_dynamics::{BoxTracker, TrackerConfig};
use dymlm_geometry::{
    Assignment, Clusters, Dbscan, DbscanConfig, DbscanScratch, IsolationForest, IsolationForestConfig,
    IsolationForestScratch, IsolationTrees, MinimumAreaRectangleScratch, VoxelGrid, VoxelGridConfig,
    VoxelGridScratch, minimum_area_rectangle_with,
};
use dymlm_octree::{Octree, OctreeConfig, UnknownCells};
use dymlm_planes::{PlaneDetector, PlaneDetectorConfig};
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame};
use dymlm_tracking::{FlowConfig, GrayImage, ImagePyramid, KcfConfig, KcfTracker, OpticalFlow};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

type Outcome = Result<(), Box<dyn Error>>;

/// Prepares an operation and runs it.
type Run = fn() -> Outcome;

/// The operations by name.
const OPERATIONS: [(&str, Run); 15] = [
    ("dbscan", dbscan),
    ("voxel_grid", voxel_grid),
    ("isolation_forest", isolation_forest),
    ("minimum_area_rectangle", rectangle),
    ("assignment", assignment),
    ("box_tracking", box_tracking),
    ("octree_insertion", octree_insertion),
    ("octree_look_ups", octree_look_ups),
    ("octree_rays", octree_rays),
    ("planes_of_a_frame", planes),
    ("cloud_insertion", cloud_insertion),
    ("static_cloud_after_a_frame", static_cloud),
    ("optical_flow", optical_flow),
    ("correlation_filter", correlation_filter),
    ("map_insertion", map_insertion),
];

fn main() -> Outcome {
    // Rayon's work stays on this thread, where it is counted.
    rayon::ThreadPoolBuilder::new().num_threads(1).use_current_thread().build_global()?;
    match std::env::args().nth(1) {
        None => OPERATIONS.iter().for_each(|(name, _)| println!("{name}")),
        Some(asked) => {
            let found = OPERATIONS.iter().find(|(name, _)| *name == asked);
            found.ok_or_else(|| format!("no operation is called {asked:?}"))?.1()?;
        }
    }
    Ok(())
}

/// Runs what is counted: `.ci/instructions` knows this function by its name.
#[inline(never)]
fn counted<R>(operation: impl FnOnce() -> R) -> R {
    black_box(operation())
}

fn dbscan() -> Outcome {
    let (dbscan, points) = (Dbscan::new(DbscanConfig::default())?, blobs(20_000));
    let (mut scratch, mut clusters) = (DbscanScratch::default(), Clusters::default());
    dbscan.cluster_into(&points, &mut scratch, &mut clusters);
    counted(|| dbscan.cluster_into(&points, &mut scratch, &mut clusters));
    Ok(())
}

fn voxel_grid() -> Outcome {
    let (grid, cloud) = (VoxelGrid::new(VoxelGridConfig::default())?, PointCloud::new(blobs(20_000)));
    let (mut scratch, mut downsampled) = (VoxelGridScratch::default(), PointCloud::default());
    grid.downsample_into(&cloud, &mut scratch, &mut downsampled);
    counted(|| grid.downsample_into(&cloud, &mut scratch, &mut downsampled));
    Ok(())
}

fn isolation_forest() -> Outcome {
    let (forest, points) = (IsolationForest::new(IsolationForestConfig::default())?, thing(5000));
    let (mut scratch, mut trees) = (IsolationForestScratch::default(), IsolationTrees::default());
    let mut scores = Vec::new();
    counted(|| {
        forest.fit_into(&points, &mut scratch, &mut trees);
        trees.scores_into(&points, &mut scores);
    });
    Ok(())
}

fn rectangle() -> Outcome {
    let (points, mut scratch) = (footprint(10_000), MinimumAreaRectangleScratch::default());
    minimum_area_rectangle_with(&points, &mut scratch);
    counted(|| minimum_area_rectangle_with(&points, &mut scratch));
    Ok(())
}

fn assignment() -> Outcome {
    const SIZE: usize = 100;
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    let weights: Vec<i64> = (0..SIZE * SIZE).map(|_| rng.random_range(0..1_000_000)).collect();
    let mut assignment = Assignment::default();
    counted(|| assignment.solve(SIZE, SIZE, |row, column| weights[SIZE * row + column]).len());
    Ok(())
}

/// A crowd of fifty that walks to the right for a second, after a third of one.
fn box_tracking() -> Outcome {
    let crowd = |frame: u8| -> Result<Vec<Detection>, Box<dyn Error>> {
        let person = |i: u8| {
            let (x, y) = (f32::from(i % 10) * 60.0 + 2.0 * f32::from(frame), f32::from(i / 10) * 90.0);
            Ok(Detection::new("person", 0.9, BoundingBox::new(x, y, x + 80.0, y + 120.0)?)?)
        };
        (0..50).map(person).collect()
    };
    let frames = (0..40).map(crowd).collect::<Result<Vec<_>, _>>()?;
    let mut tracker = BoxTracker::new(TrackerConfig::default())?;
    let mut time = 0.0;
    let mut walk = |crowds: &[Vec<Detection>]| {
        crowds.iter().try_for_each(|crowd| {
            time += 1.0 / 30.0;
            tracker.update(time, crowd, None).map(|tracks| _ = black_box(tracks))
        })
    };
    let (before, second) = frames.split_at(10);
    walk(before)?;
    counted(|| walk(second))?;
    Ok(())
}

fn room() -> Result<Frame, Box<dyn Error>> {
    Ok(Frame::new(0.0, kinect(), room_depth(), None)?)
}

/// The octree of the room, with the frame inserted once.
fn mapped_room() -> Result<(Octree, Frame), Box<dyn Error>> {
    let (mut map, frame) = (Octree::new(OctreeConfig::default())?, room()?);
    map.insert_depth(&frame, &SensorModel::kinect(), None, &Pose::identity())?;
    Ok((map, frame))
}

fn octree_insertion() -> Outcome {
    let (mut map, frame) = mapped_room()?;
    counted(|| map.insert_depth(&frame, &SensorModel::kinect(), None, &Pose::identity()))?;
    Ok(())
}

/// Points around the camera, metres.
fn random_points(count: usize) -> Vec<[f64; 3]> {
    let mut rng = ChaCha8Rng::seed_from_u64(SEED);
    (0..count).map(|_| std::array::from_fn(|_| rng.random_range(-2.0..2.0))).collect()
}

fn octree_look_ups() -> Outcome {
    let ((map, _), points) = (mapped_room()?, random_points(10_000));
    counted(|| {
        for &point in &points {
            black_box(map.state(point));
        }
    });
    Ok(())
}

fn octree_rays() -> Outcome {
    let ((map, _), points) = (mapped_room()?, random_points(1000));
    counted(|| {
        for &[x, y, _] in &points {
            black_box(map.cast_ray([0.0; 3], [0.25 * x, 0.25 * y, 1.0], 5.0, UnknownCells::Pass));
        }
    });
    Ok(())
}

fn planes() -> Outcome {
    let frame = room()?;
    let mut detector = PlaneDetector::new(&PlaneDetectorConfig::default(), &SensorModel::kinect())?;
    detector.detect(&frame, None, &[])?;
    counted(|| detector.detect(&frame, None, &[]).map(|_| ()))?;
    Ok(())
}

/// The cloud of the room from places beside each other, and the pose from which the next frame is seen.
fn cloud_of_room(frame: &Frame) -> Result<(CloudMap, Pose), Box<dyn Error>> {
    let mut map = CloudMap::new(CloudMapConfig::default(), SensorModel::kinect())?;
    let pose = |step: u32| Pose::new([0.03 * f64::from(step), 0.0, 0.0], [0.0, 0.0, 0.0, 1.0]);
    for step in 0..3 {
        map.insert(frame, None, &pose(step)?)?;
    }
    Ok((map, pose(1)?))
}

fn cloud_insertion() -> Outcome {
    let frame = room()?;
    let (mut map, pose) = cloud_of_room(&frame)?;
    counted(|| map.insert(&frame, None, &pose).map(|_| ()))?;
    Ok(())
}

fn static_cloud() -> Outcome {
    let frame = room()?;
    let (mut map, pose) = cloud_of_room(&frame)?;
    black_box(map.point_cloud(Selection::Static));
    map.insert(&frame, None, &pose)?;
    counted(|| map.point_cloud(Selection::Static));
    Ok(())
}

/// Frames of an office with people.
fn office(count: usize) -> Result<Vec<SimulatedFrame>, Box<dyn Error>> {
    let mut config = SequenceConfig::default();
    config.frames = count;
    Ok(Sequence::new(&config)?.frames().collect())
}

fn gray_images() -> Result<Vec<GrayImage>, Box<dyn Error>> {
    let frames = office(2)?;
    Ok(frames.iter().filter_map(|frame| frame.frame.color()).map(GrayImage::from_color).collect())
}

fn optical_flow() -> Outcome {
    let images = gray_images()?;
    let points: Vec<[f32; 2]> =
        (0..200_u8).map(|i| [60.0 + 26.0 * f32::from(i % 20), 60.0 + 36.0 * f32::from(i / 20)]).collect();
    let config = FlowConfig::default();
    let mut flow = OpticalFlow::new(&config)?;
    let [mut from, mut to] = [ImagePyramid::empty(config.halvings), ImagePyramid::empty(config.halvings)];
    let mut found = Vec::new();
    from.build(&images[0]);
    counted(|| {
        to.build(&images[1]);
        flow.track_into(&from, &to, &points, &points, &mut found);
    });
    Ok(())
}

fn correlation_filter() -> Outcome {
    let images = gray_images()?;
    let target = BoundingBox::new(290.0, 200.0, 354.0, 264.0)?;
    let mut tracker = KcfTracker::new(&images[0], target, &KcfConfig::default())?;
    counted(|| tracker.update(&images[1]));
    Ok(())
}

fn map_insertion() -> Outcome {
    let frames = office(4)?;
    let mut builder = MapBuilder::new(MapConfig::offline())?;
    let mut insert = |frame: &SimulatedFrame| {
        builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).map(|_| ())
    };
    let (last, before) = frames.split_last().ok_or("no frames")?;
    before.iter().try_for_each(&mut insert)?;
    counted(|| insert(last))?;
    Ok(())
}
