use dymlm::core::ObjectId;
use dymlm::core::vector3::norm;
use dymlm::{FrameReport, MultiLevelMap, Selection};
use dymlm_io::Trajectory;
use serde::Serialize;

use super::RunRecorder;
use super::floor_and_ceiling::FloorAndCeiling;
use super::layers::{Layer, cloud_layer, octree_layer, removed_layer};
use super::moved_objects::moved_objects;
use super::run_recorder::MoverWay;
use super::run_series::{MemorySeries, StageSeries};
use super::thing_history::{Stand, ThingHistory};
use super::things::{PageObject, PagePlane, millimetres, page_object, page_planes};
use crate::RunReport;

/// Most poses of the camera on the page.
const MOST_POSES: usize = 2000;

/// The run that the page describes.
#[derive(Debug, Clone, Copy)]
pub struct Run<'a> {
    /// The name of the sequence or dataset.
    pub title: &'a str,
    /// The final maps.
    pub map: &'a MultiLevelMap,
    /// The data recorded during the run.
    pub recorder: &'a RunRecorder,
    /// The report of each frame.
    pub frames: &'a [FrameReport],
    /// The summary of the run.
    pub report: &'a RunReport,
    /// The poses of the frames.
    pub trajectory: &'a Trajectory,
    /// Up in the world, of length 1.
    pub up: [f64; 3],
}

/// The JSON of the page; `things.js` and its neighbours read it.
#[derive(Debug, Clone, Serialize)]
pub(super) struct PageData<'a> {
    up: [f64; 3],
    /// A level direction along the walls.
    level: [f64; 3],
    /// Heights along up, metres.
    floor: f64,
    ceiling: Option<f64>,
    /// Time of the first frame, seconds on the maps' clock.
    start: f64,
    pub(super) cloud: Layer,
    pub(super) octree: Layer,
    pub(super) removed: Layer,
    planes: Vec<PagePlane>,
    objects: Vec<PageObject>,
    /// Objects that were in the maps and are gone.
    gone: Vec<PageObject>,
    /// Where movers went; none in corrected maps.
    movers: Vec<&'a MoverWay>,
    trajectory: Way,
    frames: StageSeries,
    memory: MemorySeries,
    report: &'a RunReport,
}

/// The camera's path: positions, metres, and quaternions x y z w, camera to world.
#[derive(Debug, Clone, PartialEq, Serialize)]
struct Way {
    positions: Vec<[f64; 3]>,
    rotations: Vec<[f64; 4]>,
}

impl<'a> PageData<'a> {
    pub(super) fn of(run: &Run<'a>) -> Self {
        let Run { map, recorder, .. } = *run;
        let up = if norm(run.up) > 0.5 { run.up } else { [0.0, 0.0, 1.0] };
        let offset = recorder.clock_offset();
        let cloud = map.cloud().point_cloud(Selection::Static);
        let room = FloorAndCeiling::find(map.planes(), &cloud, up);
        let (objects, gone, history) = objects_and_history(run);
        Self {
            up,
            level: room.level,
            floor: room.floor,
            ceiling: room.ceiling,
            start: run.frames.first().map_or(0.0, |report| report.timestamp + offset),
            cloud: cloud_layer(&cloud, map.cloud().config().voxel_size),
            octree: octree_layer(map.octree()),
            removed: removed_layer(map.cloud()),
            planes: page_planes(map.planes(), &history),
            objects,
            gone,
            movers: if is_corrected(run) { Vec::new() } else { recorder.mover_ways() },
            trajectory: Way::of(run.trajectory),
            frames: StageSeries::of(run.frames),
            memory: MemorySeries::of(recorder.memory()),
            report: run.report,
        }
    }
}

/// Whether the maps have moved since they were recorded: what was placed in them before lies beside them.
fn is_corrected(run: &Run<'_>) -> bool {
    run.report.corrections.is_some() || run.report.refinement.is_some()
}

/// The objects that are in the maps, those that are gone, and the history of all things.
fn objects_and_history(run: &Run<'_>) -> (Vec<PageObject>, Vec<PageObject>, ThingHistory) {
    let Run { map, recorder, .. } = *run;
    let mut history = ThingHistory::of_reports(run.frames, recorder.clock_offset());
    let mut objects: Vec<PageObject> =
        map.objects().objects().map(|object| page_object(object, Vec::new())).collect();
    let mut gone = Vec::new();
    // Corrected maps have moved since they were recorded, so the things seen before cannot be shown in them.
    if !is_corrected(run) {
        gone.extend(recorder.gone().cloned());
        for (from, to) in moved_objects(&gone, &objects) {
            history.take_in_move(&Stand::from(&gone[from]), &Stand::from(&objects[to]));
        }
        if let Some(before) = recorder.before() {
            history.take_in_changes(&map.world_changes_since(before));
        }
    }
    for object in objects.iter_mut().chain(&mut gone) {
        object.events = history.of_object(ObjectId::new(object.id));
    }
    (objects, gone, history)
}

impl Way {
    fn of(trajectory: &Trajectory) -> Self {
        let stride = trajectory.poses().len().div_ceil(MOST_POSES).max(1);
        let poses = || trajectory.poses().iter().step_by(stride).map(|pose| pose.world_from_camera);
        let rounded = |quaternion: [f64; 4]| quaternion.map(|q| (q * 1e4).round() / 1e4);
        Self {
            positions: poses().map(|pose| millimetres(pose.translation())).collect(),
            rotations: poses().map(|pose| rounded(pose.quaternion())).collect(),
        }
    }
}
