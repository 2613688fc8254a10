use std::collections::BTreeMap;

use dymlm_core::{FrameId, ObjectId, PlaneId, Pose, SensorModel};
use dymlm_planes::{PlaneMap, PlaneSighting};
use dymlm_refine::{LandmarkView, PlaneView, PoseGraph, RelativePose, Solution, SolverConfig};

use super::links::{Link, links_between};
use super::object_views::views_by_object;
use super::odometry_drift::OdometryDrift;
use super::plane_groups::PlaneGroups;
use super::plane_visits::{PlaneVisit, plane_visits};
use super::unheld_motion::unheld_motions;
use super::{LoopClosure, RefineConfig, RefinedPoses, UnheldMotion};
use crate::session_log::{InsertedFrame, SessionLog};
use crate::{Error, MultiLevelMap};

/// Most searches for visits that may be of one plane before the maps are built again.
const MOST_SEARCHES: usize = 10;

/// Most key frames at which the covariance of the pose is examined, evenly chosen.
const CERTAINTIES: usize = 32;

/// A key frame of the log.
#[derive(Debug, Clone, Copy)]
pub(super) struct KeyFramePose {
    frame: FrameId,
    /// Time on the maps' clock, seconds.
    pub(super) time: f64,
    pub(super) world_from_camera: Pose,
    /// Number of sessions that had begun.
    session: usize,
}

/// What the maps and the caller know of the key frames' poses.
pub(super) struct PoseProblem<'a> {
    /// The key frames with the caller's poses.
    given: &'a [KeyFramePose],
    /// The poses that the key frames have in the maps.
    poses: Vec<Pose>,
    /// Loop closures between key frames, each with its place in the caller's list.
    closures: Vec<(usize, RelativePose)>,
    /// The views of each plane, by key frame.
    views: BTreeMap<PlaneId, Vec<PlaneView>>,
    /// Within which the map associates planes, metres.
    max_distance: f64,
    /// The views of each object's centre.
    object_views: BTreeMap<ObjectId, Vec<LandmarkView>>,
    config: &'a RefineConfig,
}

/// A graph and its solution.
struct Found {
    graph: PoseGraph,
    solution: Solution,
    /// By link, whether both its views count in the solution.
    holds: Vec<bool>,
}

impl<'a> PoseProblem<'a> {
    /// Takes maps with a log; `given`: the log's key frames with the caller's poses.
    pub(super) fn new(
        map: &MultiLevelMap,
        log: &SessionLog,
        given: &'a [KeyFramePose],
        config: &'a RefineConfig,
        closures: &[LoopClosure],
    ) -> Result<Self, Error> {
        let key_frames = key_frame_poses(log);
        Ok(Self {
            given,
            poses: key_frames.iter().map(|key_frame| key_frame.world_from_camera).collect(),
            closures: between_key_frames(closures, log, &key_frames)?,
            views: views_by_plane(&map.planes, &key_frames, &map.config.sensor, config),
            max_distance: map.config.planes.map.association.max_distance,
            object_views: views_by_object(map.objects(), &key_frames, &map.config.sensor, config),
            config,
        })
    }

    /// The poses that fit best.
    pub(super) fn solve(&self) -> Result<RefinedPoses, Error> {
        let drift = self.drift();
        let visits = plane_visits(&self.views, &self.poses, &drift, self.max_distance);
        let mut groups = PlaneGroups::new(&visits, self.max_distance);
        let (initial_cost, links, poses) = self.link_visits(&visits, &groups, &drift)?;
        let found = self.group_visits(&mut groups, links, poses)?;
        let unheld = self.unheld(&found, &drift)?;
        let solution = found.solution;
        let frames = self.given.iter().map(|key_frame| key_frame.frame);
        let is_of_several = |views: &&Vec<PlaneView>| views.iter().any(|view| view.pose != views[0].pose);
        let has_several = |views: &&Vec<LandmarkView>| views.iter().any(|view| view.pose != views[0].pose);
        Ok(RefinedPoses {
            poses: frames.zip(solution.poses).collect(),
            planes: self.views.values().filter(is_of_several).count(),
            views: self.views.values().map(Vec::len).sum(),
            views_left_out: solution.views_left_out.len(),
            met_again: groups.joined_planes(),
            parted: groups.parted(),
            objects: self.object_views.values().filter(has_several).count(),
            object_views: self.object_views.values().map(Vec::len).sum(),
            object_views_left_out: solution.landmark_views_left_out.len(),
            unheld,
            cost: [initial_cost, solution.final_cost],
            left_out: solution.left_out.into_iter().map(|closure| self.closures[closure].0).collect(),
        })
    }

    /// Solves with all visits apart and links between those that may be of one plane. Better poses show other
    /// links, so search and solve alternate until a search finds links that were tried. Returns the cost at the
    /// start, and of the last solution the links to group visits by, and the poses.
    fn link_visits(
        &self,
        visits: &[PlaneVisit<'_>],
        groups: &PlaneGroups<'_>,
        drift: &OdometryDrift,
    ) -> Result<(f64, Vec<Link>, Vec<Pose>), Error> {
        let ends = |links: &[Link]| links.iter().map(|link| link.visits).collect::<Vec<_>>();
        let mut links = links_between(visits, &self.poses, drift);
        let mut found = self.solve_with(&self.poses, groups, &links)?;
        let (initial_cost, mut tried) = (found.solution.initial_cost, vec![ends(&links)]);
        while tried.len() < MOST_SEARCHES {
            let next = links_between(visits, &found.solution.poses, drift);
            if tried.contains(&ends(&next)) {
                break;
            }
            found = self.solve_with(&found.solution.poses, groups, &next)?;
            tried.push(ends(&next));
            links = next;
        }
        // Visits to one plane of the map are tried even if the solver dropped their link: the map's tolerance
        // decides.
        let mut holds = found.holds.iter();
        links.retain(|link| holds.next() == Some(&true) || link.is_of_one_plane(visits));
        Ok((initial_cost, links, found.solution.poses))
    }

    /// Takes visits together that turn out to be of one plane, and solves, until there are no more of them.
    /// Links that are left over are wrong. Returns the last solution.
    fn group_visits(
        &self,
        groups: &mut PlaneGroups<'_>,
        mut links: Vec<Link>,
        mut poses: Vec<Pose>,
    ) -> Result<Found, Error> {
        loop {
            let between = groups.join(&links, &poses)?;
            let is_last = between.len() == links.len();
            links = if is_last { Vec::new() } else { between };
            let found = self.solve_with(&poses, groups, &links)?;
            if links.is_empty() {
                return Ok(found);
            }
            poses = found.solution.poses;
        }
    }

    /// Solves, starting from `poses`, with groups of visits that are of one plane, and with links between
    /// groups that may be.
    fn solve_with(&self, poses: &[Pose], groups: &PlaneGroups<'_>, links: &[Link]) -> Result<Found, Error> {
        let mut graph = PoseGraph::new(poses.iter().copied());
        for (from, pair) in self.given.windows(2).enumerate() {
            graph.add_relative(&odometry(from, pair, self.config))?;
        }
        for (_, closure) in &self.closures {
            graph.add_loop_closure(closure)?;
        }
        for views in groups.views() {
            graph.add_plane(views)?;
        }
        for link in links {
            graph.add_plane(&link.views)?;
        }
        for views in self.object_views.values() {
            graph.add_landmark(views)?;
        }
        let solution = graph.optimize(&SolverConfig::default())?;
        let first = groups.views().len();
        let counts = |plane: usize, view: usize| {
            solution.views_left_out.binary_search(&[first + plane, view]).is_err()
        };
        let holds = (0..links.len()).map(|link| counts(link, 0) && counts(link, 1)).collect();
        Ok(Found { graph, solution, holds })
    }

    fn drift(&self) -> OdometryDrift {
        let steps = self.given.windows(2).map(|pair| deviations(pair, self.config));
        let poses: Vec<Pose> = self.given.iter().map(|key_frame| key_frame.world_from_camera).collect();
        OdometryDrift::new(&poses, steps)
    }

    /// Motions that odometry alone determines, at some of the key frames.
    fn unheld(&self, found: &Found, drift: &OdometryDrift) -> Result<Vec<UnheldMotion>, Error> {
        let step = self.given.len().div_ceil(CERTAINTIES).max(1);
        let mut chosen: Vec<usize> = (1..self.given.len()).rev().step_by(step).collect();
        chosen.reverse();
        let covariances = found.graph.covariances(&found.solution, &chosen)?;
        let unheld = chosen.into_iter().zip(&covariances).flat_map(|(index, covariance)| {
            let (frame, pose) = (self.given[index].frame, &found.solution.poses[index]);
            unheld_motions(frame, pose, covariance, &drift.before(index, pose.translation()))
        });
        Ok(unheld.collect())
    }
}

/// The key frames, with the poses at which they are mapped.
pub(super) fn key_frame_poses(log: &SessionLog) -> Vec<KeyFramePose> {
    let key_frames = log.key_frames().filter_map(|entry| Some((entry.frame, log.frame(entry.frame)?)));
    let of = |(frame, inserted): (FrameId, &InsertedFrame)| KeyFramePose {
        frame,
        time: inserted.map_time(),
        world_from_camera: inserted.world_from_camera,
        session: log.sessions.partition_point(|session| session.first <= frame),
    };
    key_frames.map(of).collect()
}

/// Standard deviations of the rotation and of the translation (of one axis) between two consecutive key
/// frames.
fn deviations(pair: &[KeyFramePose], config: &RefineConfig) -> [f64; 2] {
    let [one, next] = [pair[0], pair[1]];
    if one.session == next.session {
        config.deviations((next.time - one.time).abs())
    } else {
        [config.session_rotation, config.session_translation]
    }
}

/// The relative pose of two consecutive key frames, by the caller's poses.
fn odometry(from: usize, pair: &[KeyFramePose], config: &RefineConfig) -> RelativePose {
    let ([one, next], [rotation, translation]) = ([pair[0], pair[1]], deviations(pair, config));
    let measured = one.world_from_camera.inverse() * next.world_from_camera;
    RelativePose::with_deviations(from, from + 1, measured, rotation, translation)
}

/// Loop closures, moved from their frames to the key frames at or before these, each with its place in the
/// list. Those within one key frame say nothing of the key frames' poses and are left away.
fn between_key_frames(
    closures: &[LoopClosure],
    log: &SessionLog,
    key_frames: &[KeyFramePose],
) -> Result<Vec<(usize, RelativePose)>, Error> {
    let places: BTreeMap<FrameId, usize> =
        key_frames.iter().enumerate().map(|(index, key_frame)| (key_frame.frame, index)).collect();
    // The index of a frame's key frame, and the frame's pose in the coordinates of that key frame's camera.
    let on_key_frame = |frame: FrameId| {
        let inserted = log.frame(frame).ok_or(Error::UnknownFrame { frame })?;
        let before = places.range(..=frame).next_back().or_else(|| places.iter().next());
        let &index = before.ok_or(Error::NoKeyFrames)?.1;
        Ok::<_, Error>((index, key_frames[index].world_from_camera.inverse() * inserted.world_from_camera))
    };
    let mut between = Vec::with_capacity(closures.len());
    for (place, closure) in closures.iter().enumerate() {
        let [rotation, translation] = closure.checked_deviations(place)?;
        let ((from, own), (to, other)) = (on_key_frame(closure.from)?, on_key_frame(closure.to)?);
        if from != to {
            let measured = own * closure.from_from_to * other.inverse();
            between.push((place, RelativePose::with_deviations(from, to, measured, rotation, translation)));
        }
    }
    Ok(between)
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
        // The plane map numbers the key frames as the log does, and has them at the same poses.
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
    // A reading of weight 1 has the least noise that the sensor has.
    let least = f64::from(sensor.noise.floor);
    let variance = common * common + least * least / sighting.weight.max(1e-9);
    let &PlaneSighting { centroid, covariance, .. } = sighting;
    PlaneView { pose, information: 1.0 / variance, centroid, covariance }
}
