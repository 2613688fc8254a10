use std::collections::BTreeMap;

use dymlm_core::{FrameId, PlaneId, Pose, SensorModel};
use dymlm_planes::{PlaneMap, PlaneSighting};
use dymlm_refine::{PlaneView, PoseGraph, RelativePose, SolverConfig};

use super::{LoopClosure, RefineConfig, RefineReport};
use crate::session_log::SessionLog;
use crate::{Error, MapBuilder};

/// A key frame of the log.
#[derive(Debug, Clone, Copy)]
struct KeyFramePose {
    frame: FrameId,
    /// On the maps' clock, seconds.
    time: f64,
    world_from_camera: Pose,
    /// How many sessions had begun.
    session: usize,
}

impl MapBuilder {
    /// Finds better poses of the key frames by the planes that they have seen, and [corrects](
    /// Self::correct_poses) all maps by them: a wall that was seen again after a while is one wall. The
    /// caller's poses count as odometry, see [`RefineConfig`]; what no plane holds stays as they have it. The
    /// first key frame stays where it is.
    ///
    /// Costs as many corrections as there are [rounds](RefineConfig::rounds), and a sparse solve for each.
    ///
    /// # Errors
    ///
    /// [`Error::Config`], [`Error::Refinement`] and those of [`Self::correct_poses`]. What rounds before have
    /// found stays.
    #[doc(alias = "bundle adjustment")]
    pub fn refine_poses(&mut self, config: &RefineConfig) -> Result<RefineReport, Error> {
        self.refine_poses_with(config, &[])
    }

    /// [`Self::refine_poses`], with loop closures that a place recognition has found. Wrong ones, which
    /// contradict the planes, the odometry and each other, are left out and named in the report.
    ///
    /// # Errors
    ///
    /// As [`Self::refine_poses`]; [`Error::UnknownFrame`] of a closure; [`Error::Refinement`] when its
    /// deviations are not positive.
    #[doc(alias = "pose graph")]
    pub fn refine_poses_with(
        &mut self,
        config: &RefineConfig,
        closures: &[LoopClosure],
    ) -> Result<RefineReport, Error> {
        config.validate()?;
        let log = self.map.past.log.as_ref().ok_or(Error::NoHistory)?;
        let given = key_frame_poses(log);
        let closures = between_key_frames(closures, log, &given)?;
        let mut report = self.refine_once(&given, &closures, config)?;
        for _ in 1..config.rounds {
            let costs = std::mem::take(&mut report.costs);
            report = self.refine_once(&given, &closures, config)?;
            report.costs.splice(0..0, costs);
        }
        Ok(report)
    }

    /// One round. `given`: the key frames as the caller had them.
    fn refine_once(
        &mut self,
        given: &[KeyFramePose],
        closures: &[RelativePose],
        config: &RefineConfig,
    ) -> Result<RefineReport, Error> {
        let log = self.map.past.log.as_ref().ok_or(Error::NoHistory)?;
        let key_frames = key_frame_poses(log);
        let mut graph = PoseGraph::new(key_frames.iter().map(|key_frame| key_frame.world_from_camera));
        for (from, pair) in given.windows(2).enumerate() {
            graph.add_relative(&odometry(from, pair, config))?;
        }
        for closure in closures {
            graph.add_loop_closure(closure)?;
        }
        let views = views_by_plane(&self.map.planes, &key_frames, &self.config.sensor, config);
        let (mut planes, mut count) = (0, 0);
        for views in views.values() {
            graph.add_plane(views)?;
            planes += usize::from(views.iter().any(|view| view.pose != views[0].pose));
            count += views.len();
        }
        let solution = graph.optimize(&SolverConfig::default())?;
        let poses: Vec<(FrameId, Pose)> =
            key_frames.iter().map(|key_frame| key_frame.frame).zip(solution.poses).collect();
        let correction = self.correct_poses(&poses)?;
        let costs = vec![[solution.initial_cost, solution.final_cost]];
        Ok(RefineReport { planes, views: count, costs, left_out: solution.left_out, correction })
    }
}

fn key_frame_poses(log: &SessionLog) -> Vec<KeyFramePose> {
    let key_frames = log.key_frames().filter_map(|entry| Some((entry.frame, log.frame(entry.frame)?)));
    let of = |(frame, inserted): (FrameId, &crate::session_log::InsertedFrame)| KeyFramePose {
        frame,
        time: inserted.map_time(),
        world_from_camera: inserted.world_from_camera,
        session: log.sessions.partition_point(|session| session.first <= frame),
    };
    key_frames.map(of).collect()
}

/// What the caller's poses say of two key frames that follow each other.
fn odometry(from: usize, pair: &[KeyFramePose], config: &RefineConfig) -> RelativePose {
    let [one, next] = [pair[0], pair[1]];
    let [rotation, translation] = if one.session == next.session {
        config.deviations((next.time - one.time).abs())
    } else {
        [config.session_rotation, config.session_translation]
    };
    let measured = one.world_from_camera.inverse() * next.world_from_camera;
    RelativePose::with_deviations(from, from + 1, measured, rotation, translation)
}

/// Loop closures as they are between the key frames at or before their frames.
fn between_key_frames(
    closures: &[LoopClosure],
    log: &SessionLog,
    key_frames: &[KeyFramePose],
) -> Result<Vec<RelativePose>, Error> {
    let places: BTreeMap<FrameId, usize> =
        key_frames.iter().enumerate().map(|(index, key_frame)| (key_frame.frame, index)).collect();
    // A frame's key frame, and where the frame is in its camera's coordinates.
    let on_key_frame = |frame: FrameId| {
        let inserted = log.frame(frame).ok_or(Error::UnknownFrame { frame })?;
        let before = places.range(..=frame).next_back().or_else(|| places.iter().next());
        let &index = before.ok_or(Error::UnknownFrame { frame })?.1;
        Ok::<_, Error>((index, key_frames[index].world_from_camera.inverse() * inserted.world_from_camera))
    };
    let between = |closure: &LoopClosure| {
        let &LoopClosure { from, to, from_from_to, rotation_deviation, translation_deviation } = closure;
        let ((from, own), (to, other)) = (on_key_frame(from)?, on_key_frame(to)?);
        let measured = own * from_from_to * other.inverse();
        Ok(RelativePose::with_deviations(from, to, measured, rotation_deviation, translation_deviation))
    };
    closures.iter().map(between).collect()
}

/// What the key frames have seen of each plane.
fn views_by_plane(
    planes: &PlaneMap,
    key_frames: &[KeyFramePose],
    sensor: &SensorModel,
    config: &RefineConfig,
) -> BTreeMap<PlaneId, Vec<PlaneView>> {
    let mut views: BTreeMap<PlaneId, Vec<PlaneView>> = BTreeMap::new();
    for sighting in planes.key_frame_sightings() {
        // The plane map counts the key frames as the log has them, at the same poses.
        let index = sighting.key_frame.get() as usize;
        let Some(key_frame) = key_frames.get(index) else { continue };
        if key_frame.world_from_camera != sighting.world_from_camera {
            continue;
        }
        views.entry(sighting.plane).or_default().push(view(index, &sighting, sensor, config));
    }
    views
}

fn view(pose: usize, sighting: &PlaneSighting, sensor: &SensorModel, config: &RefineConfig) -> PlaneView {
    let common = config.common_noise * f64::from(sensor.sigma(sighting.centroid[2] as f32));
    // A reading of weight 1 errs as one at 0.4 m does.
    let least = f64::from(sensor.sigma(0.4));
    let variance = common * common + least * least / sighting.weight.max(1e-9);
    let &PlaneSighting { centroid, covariance, .. } = sighting;
    PlaneView { pose, information: 1.0 / variance, centroid, covariance }
}
