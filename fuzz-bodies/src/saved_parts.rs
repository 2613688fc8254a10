use dymlm::cloud::CloudMap;
use dymlm::history::{History, Observation};
use dymlm::objects::{MapObject, NoPlanes, ObjectMapper, ObjectView};
use dymlm::octree::Octree;
use dymlm::planes::{PlaneDetector, PlaneMap};
use dymlm::{HistoryConfig, Selection};
use dymlm_core::{FrameId, StateSink};
use dymlm_sim::SimulatedFrame;

use crate::choices::Choices;
use crate::damage::damage;
use crate::walk::{MAP, MAPPED, Parts, SAVED, WALK};

fn damaged(section: &str, bytes: &[u8]) -> Parts {
    let mut parts = SAVED[section].clone();
    damage(&mut parts, &mut Choices::new(bytes));
    parts
}

/// All parts that `save` writes.
fn saved(save: impl FnOnce(&mut StateSink<'_>) -> std::io::Result<()>) -> Parts {
    let mut parts = Parts::new();
    let mut sink = |key, bytes: Option<&[u8]>| {
        parts.push((key, bytes.unwrap().to_vec()));
        Ok(())
    };
    save(&mut sink).unwrap();
    parts
}

/// A frame after those of the map.
fn next() -> &'static SimulatedFrame {
    &WALK[MAPPED]
}

/// The parts of a cloud map: a map that loads takes further frames, and is saved and loaded again.
pub fn saved_cloud(bytes: &[u8]) {
    let load = |parts| CloudMap::load_state(MAP.config().cloud.clone(), MAP.config().sensor, parts);
    let Ok(mut map) = load(damaged("cloud", bytes)) else { return };
    load(saved(|sink| map.save_state(None, sink))).unwrap();
    let next = next();
    let _ = map.insert(&next.frame, None, &next.world_from_camera);
    let _ = (map.point_cloud(Selection::Static), map.history([0.0, 0.0, 1.0]), map.held_voxels());
    let _ = map.is_long_free([0.1, 0.0, 1.2], 0.1);
    let _ = map.verdicts().ghost_boxes_since(1).count();
    load(saved(|sink| map.save_state(None, sink))).unwrap();
    map.forget_outside(next.world_from_camera.translation(), 2.0);
    load(saved(|sink| map.save_state(None, sink))).unwrap();
}

/// The parts of an octree.
pub fn saved_octree(bytes: &[u8]) {
    let load = |parts| Octree::load_state(MAP.config().octree.clone(), parts);
    let Ok(mut map) = load(damaged("octree", bytes)) else { return };
    load(saved(|sink| map.save_state(None, sink))).unwrap();
    let next = next();
    let _ = map.insert_depth(&next.frame, &MAP.config().sensor, None, &next.world_from_camera);
    let _ = (map.counts(), map.leaves().count(), map.nearest_obstacle([0.0; 3], 0.5));
    map.write_ot(&mut Vec::new()).unwrap();
    map.write_bt(&mut Vec::new()).unwrap();
    load(saved(|sink| map.save_state(None, sink))).unwrap();
}

/// The parts of a map of planes.
pub fn saved_planes(bytes: &[u8]) {
    let config = MAP.config();
    let load = |parts| PlaneMap::load_state(config.planes.map.clone(), config.sensor, parts);
    let Ok(mut map) = load(damaged("planes", bytes)) else { return };
    load(saved(|sink| map.save_state(None, sink))).unwrap();
    let next = next();
    let mut detector = PlaneDetector::new(&config.planes.detector, &config.sensor).unwrap();
    let detected = detector.detect(&next.frame, None, &[]).unwrap();
    let _ = map.insert(detected, &next.frame, &next.world_from_camera);
    let _: Vec<_> = map.iter().map(|plane| (plane.boundary(), plane.area())).collect();
    let _ = map.plane_under([0.1, 0.2, 1.0], [0.0, 0.0, 1.0], 3.0);
    load(saved(|sink| map.save_state(None, sink))).unwrap();
    let _ = map.remove(FrameId::new(u64::from(bytes.last().copied().unwrap_or_default()) % 12));
    map.judge([[[-1.0; 3], [1.0; 3]]], Some([[-2.0; 3], [2.0; 3]]), 0.5, |place| Some(place[2] > 0.5));
    map.forget_outside(next.world_from_camera.translation(), 2.0);
    load(saved(|sink| map.save_state(None, sink))).unwrap();
}

/// The parts of a map of objects.
pub fn saved_objects(bytes: &[u8]) {
    let load = |parts| ObjectMapper::load_state(MAP.config().objects.clone(), MAP.config().sensor, parts);
    let Ok(mut mapper) = load(damaged("objects", bytes)) else { return };
    load(saved(|sink| mapper.save_state(None, sink))).unwrap();
    let SimulatedFrame { frame, detections, world_from_camera, .. } = next();
    let _ = mapper.insert(&ObjectView::new(frame, detections, world_from_camera), &NoPlanes);
    let _ = format!("{:?}", mapper.map().objects().chain(mapper.map().candidates()).collect::<Vec<_>>());
    let first = mapper.map().objects().map(MapObject::id).next();
    if let Some(object) = first {
        mapper.hold(object);
        mapper.move_object(object, world_from_camera);
        mapper.release(object);
    }
    load(saved(|sink| mapper.save_state(None, sink))).unwrap();
    mapper.forget_outside(world_from_camera.translation(), 2.0);
    load(saved(|sink| mapper.save_state(None, sink))).unwrap();
}

/// The parts of a history: an entry is checked only when it is requested.
pub fn saved_history(bytes: &[u8]) {
    let load = |parts| History::load_state(&HistoryConfig::Memory, parts).map(Option::unwrap);
    let Ok(mut history) = load(damaged("history", bytes)) else { return };
    for index in 0..2 * MAPPED {
        let _ = (history.get(index), history.scan(index));
    }
    let observation = Observation::of_frame(&next().frame).unwrap();
    let index = history.push(observation.into());
    history.settle();
    history.get(index).unwrap();
    history.remove(0);
    load(saved(|sink| history.save_state(None, sink))).unwrap().get(index).unwrap();
}
