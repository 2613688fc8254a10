//! What tests of the facade share.
#![allow(dead_code, reason = "not every test uses all")]

pub(crate) mod map_copy;

use dymlm::core::{FrameId, ObjectId, PinholeCamera, PlaneId, Pose};
use dymlm::objects::MapObject;
use dymlm::planes::MapPlane;
use dymlm::{CorrectionReport, MapBuilder, MapConfig, MultiLevelMap, Selection};
use dymlm_sim::{Sequence, SequenceConfig, SimulatedFrame};

/// A short walk, small enough for a test: a sixteenth of the pixels of a Kinect.
pub(crate) fn sequence(frames: usize) -> Sequence {
    sequence_by(PinholeCamera::new(160, 120, 131.25, 131.25, 79.5, 59.5).unwrap(), frames)
}

/// A short walk with a camera.
pub(crate) fn sequence_by(camera: PinholeCamera, frames: usize) -> Sequence {
    let mut config = SequenceConfig::default();
    (config.frames, config.camera) = (frames, Some(camera));
    Sequence::new(&config).unwrap()
}

/// A quarter of the pixels of a Kinect.
pub(crate) fn fine_camera() -> PinholeCamera {
    PinholeCamera::new(320, 240, 262.5, 262.5, 159.5, 119.5).unwrap()
}

pub(crate) fn config() -> MapConfig {
    let mut config = MapConfig::default();
    // A quarter of the resolution, voxels of four times the size.
    config.cloud.voxel_size = 0.04;
    config
}

pub(crate) fn insert_all(builder: &mut MapBuilder, frames: &[SimulatedFrame]) {
    for frame in frames {
        builder.insert(&frame.frame, &frame.detections, &frame.world_from_camera).unwrap();
    }
}

/// Where the frames were taken from, as a caller knows it.
pub(crate) fn poses(builder: &MapBuilder) -> Vec<(FrameId, Pose)> {
    builder.trajectory().map(|(id, _, pose)| (id, pose)).collect()
}

/// Corrects poses; the report, and how many key frames and scans were mapped again.
pub(crate) fn correct_counted(
    builder: &mut MapBuilder,
    given: &[(FrameId, Pose)],
) -> (CorrectionReport, usize) {
    let mut total = 0;
    let report = builder.correct_poses_watched(given, &mut |progress| {
        total = progress.total;
        true
    });
    (report.unwrap(), total)
}

/// Everything that the maps say, in bytes.
pub(crate) fn fingerprint(map: &MultiLevelMap) -> Vec<u8> {
    let mut bytes = fingerprint_without_ids(map);
    let planes = map.planes().iter().chain(map.planes().candidates()).map(|plane| plane.id().get());
    let objects = map.objects().objects().chain(map.objects().candidates()).map(|object| object.id().get());
    bytes.extend(planes.chain(objects).flat_map(u64::to_le_bytes));
    bytes
}

/// Everything but how planes and objects are called.
pub(crate) fn fingerprint_without_ids(map: &MultiLevelMap) -> Vec<u8> {
    let cloud = map.cloud().point_cloud(Selection::Static);
    let mut bytes: Vec<u8> = cloud.points().iter().flatten().flat_map(|c| c.to_le_bytes()).collect();
    bytes.extend(cloud.colors().into_iter().flatten().flatten());
    map.octree().write_ot(&mut bytes).unwrap();
    let mut planes: Vec<Vec<u8>> = Vec::new();
    for plane in map.planes().iter().chain(map.planes().candidates()) {
        let mut own = Vec::new();
        own.extend(plane.plane().normal().iter().chain([&plane.plane().d()]).flat_map(|c| c.to_le_bytes()));
        own.extend(plane.inlier_points().flatten().flat_map(f32::to_le_bytes));
        planes.push(own);
    }
    let mut objects: Vec<Vec<u8>> = Vec::new();
    for object in map.objects().objects().chain(map.objects().candidates()) {
        let mut own: Vec<u8> = Vec::new();
        own.extend(object.oriented_box().corners().iter().flatten().flat_map(|c| c.to_le_bytes()));
        own.extend(object.label().bytes());
        own.extend(object.observations().to_le_bytes());
        for sighting in object.sightings_by_side().flatten() {
            let numbers = sighting.world_from_camera.translation().into_iter().chain(sighting.direction);
            own.extend(numbers.chain([sighting.timestamp, sighting.nearest]).flat_map(f64::to_le_bytes));
        }
        objects.push(own);
    }
    for things in [&mut planes, &mut objects] {
        things.sort();
        bytes.extend(things.iter().flatten());
    }
    bytes
}

/// The ids of all planes and objects, believed or not.
pub(crate) fn ids(map: &MultiLevelMap) -> (Vec<PlaneId>, Vec<ObjectId>) {
    (
        map.planes().iter().chain(map.planes().candidates()).map(MapPlane::id).collect(),
        map.objects().objects().chain(map.objects().candidates()).map(MapObject::id).collect(),
    )
}
