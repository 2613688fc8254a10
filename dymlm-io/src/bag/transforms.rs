use std::collections::BTreeMap;

use dymlm_core::Pose;

use crate::ros2::messages::{Transform, TransformStamped};
use crate::{StampedPose, Trajectory, UncoveredTime};

/// Two transforms closer than this, metres and radians, are interpolated however long the time between them:
/// the motion in between is smaller than the errors of poses.
const STILL: [f64; 2] = [0.02, 0.0175];

/// Why tf gives no pose of a frame.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoTransform {
    /// The frames are not connected.
    #[error("no transforms lead from frame {frame:?} to {to:?}: those above it end at {root:?}")]
    NotConnected {
        /// The frame whose transform is wanted.
        frame: String,
        /// The frame that the transform should lead to.
        to: String,
        /// The root of the tree above `frame`.
        root: String,
    },
    /// Only fixed transforms are above the camera: nothing says how it moves in the world.
    #[error(
        "nothing moves frame {root:?} above {frame:?}: there are no poses (for a camera that stands still, name the world frame)"
    )]
    NoMotion {
        /// The camera's frame.
        frame: String,
        /// The root of the tree above the camera.
        root: String,
    },
    /// The transforms above a frame form a loop.
    #[error("the transforms above frame {frame:?} are a loop")]
    Loop {
        /// The frame.
        frame: String,
    },
    /// A transform is not known at the frame's time.
    #[error("transform {parent:?} -> {child:?}: {fault}")]
    Uncovered {
        /// The parent frame of the transform.
        parent: String,
        /// The child frame of the transform.
        child: String,
        /// The time asked for, and the times that are covered.
        fault: UncoveredTime,
    },
    /// The trajectory that is used instead of tf does not cover the time.
    #[error(transparent)]
    Trajectory(#[from] UncoveredTime),
}

/// The pose of each frame in its parent over time. It is used once all transforms are read. Of the parents
/// that a bag gives a frame, the first one counts, and of fixed transforms the last.
#[derive(Debug, Default)]
pub(super) struct TransformTree {
    edges: BTreeMap<String, Edge>,
    /// Number of transforms left out because their child has another parent, by child and parent.
    pub(super) second_parents: BTreeMap<(String, String), usize>,
}

#[derive(Debug)]
struct Edge {
    parent: String,
    motion: Motion,
}

#[derive(Debug)]
enum Motion {
    Fixed(Pose),
    /// In the order of reading; [`TransformTree::settle`] makes them a trajectory.
    Listed(Vec<StampedPose>),
    Moving(Trajectory),
}

/// The frames from a start up to an ancestor.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chain {
    /// All frames of the chain but the last.
    children: Vec<String>,
}

pub(super) fn pose_of(transform: &Transform) -> Result<Pose, String> {
    let Transform { translation: t, rotation: r } = transform;
    Pose::new([t.x, t.y, t.z], [r.x, r.y, r.z, r.w]).map_err(|error| error.to_string())
}

/// Strips the leading slash that frames had in the first tf.
pub(super) fn frame_name(frame: &str) -> &str {
    frame.strip_prefix('/').unwrap_or(frame)
}

impl TransformTree {
    /// Adds the transforms of a message. One that is wrong does not keep the others out.
    ///
    /// # Errors
    ///
    /// What is wrong with the first of those that were left out.
    pub(super) fn add_all(
        &mut self,
        given: &[TransformStamped],
        is_fixed: bool,
        recorded: Option<f64>,
    ) -> Result<(), String> {
        let mut first = Ok(());
        for transform in given {
            let added = self.add(transform, is_fixed, recorded);
            first = first.and(added);
        }
        first
    }

    /// Adds a transform. A fixed one (`is_fixed`) holds at all times, and a later one replaces it. A moving
    /// one without a time stamp gets the time at which it was `recorded`.
    pub(super) fn add(
        &mut self,
        given: &TransformStamped,
        is_fixed: bool,
        recorded: Option<f64>,
    ) -> Result<(), String> {
        let (parent, child) = (frame_name(&given.header.frame_id), frame_name(&given.child_frame_id));
        if parent.is_empty() || child.is_empty() || parent == child {
            return Err(format!("transform {parent:?} -> {child:?}: needs two different frames"));
        }
        let pose = pose_of(&given.transform)?;
        let timestamp = given.header.stamp.seconds().or(recorded);
        if !is_fixed && timestamp.is_none() {
            return Err("a moving transform without a time".to_owned());
        }
        let edge = self.edges.entry(child.to_owned()).or_insert_with(|| Edge {
            parent: parent.to_owned(),
            motion: if is_fixed { Motion::Fixed(pose) } else { Motion::Listed(Vec::new()) },
        });
        if edge.parent != parent {
            *self.second_parents.entry((child.to_owned(), parent.to_owned())).or_default() += 1;
            return Ok(());
        }
        match (&mut edge.motion, timestamp) {
            (Motion::Fixed(fixed), _) if is_fixed => *fixed = pose,
            (Motion::Listed(poses), Some(timestamp)) if !is_fixed => {
                poses.push(StampedPose { timestamp, world_from_camera: pose });
            }
            _ => return Err(format!("the transform {parent:?} -> {child:?} is both fixed and moving")),
        }
        Ok(())
    }

    /// Removes a frame's transform to its parent.
    pub(super) fn remove(&mut self, child: &str) {
        self.edges.remove(frame_name(child));
    }

    pub(super) fn has_parent(&self, child: &str) -> bool {
        self.edges.contains_key(frame_name(child))
    }

    /// Turns the listed poses into trajectories, once all transforms are added.
    pub(super) fn settle(&mut self) -> Result<(), dymlm_core::Error> {
        for edge in self.edges.values_mut() {
            if let Motion::Listed(poses) = &mut edge.motion {
                edge.motion = Motion::Moving(Trajectory::new(std::mem::take(poses))?);
            }
        }
        Ok(())
    }

    /// The chain from a frame up to the world: the frame named `world`, or the root.
    pub(super) fn chain_to_world(&self, frame: &str, world: Option<&str>) -> Result<Chain, NoTransform> {
        let frames = self.ancestry(frame)?;
        let root = frames.last().cloned().unwrap_or_default();
        let end = match world.map(frame_name) {
            Some(world) => {
                frames.iter().position(|frame| frame == world).ok_or_else(|| NoTransform::NotConnected {
                    frame: frame.to_owned(),
                    to: world.to_owned(),
                    root: root.clone(),
                })?
            }
            None => frames.len().saturating_sub(1),
        };
        let children: Vec<String> = frames.into_iter().take(end).collect();
        let moves = |child: &String| {
            self.edges.get(child).is_some_and(|edge| matches!(edge.motion, Motion::Moving(_)))
        };
        if world.is_none() && !children.iter().any(moves) {
            return Err(NoTransform::NoMotion { frame: frame.to_owned(), root });
        }
        Ok(Chain { children })
    }

    /// Takes coordinates of the chain's first frame to its last frame.
    pub(super) fn pose_at(&self, chain: &Chain, timestamp: f64, max_gap: f64) -> Result<Pose, NoTransform> {
        let mut pose: Option<Pose> = None;
        for child in &chain.children {
            let Some(edge) = self.edges.get(child) else { continue };
            let step = match &edge.motion {
                Motion::Fixed(fixed) => *fixed,
                Motion::Moving(trajectory) => {
                    let max_gap = if is_still(trajectory, timestamp) { f64::INFINITY } else { max_gap };
                    trajectory.pose_at(timestamp, max_gap).map_err(|fault| NoTransform::Uncovered {
                        parent: edge.parent.clone(),
                        child: child.clone(),
                        fault,
                    })?
                }
                Motion::Listed(_) => continue,
            };
            // No product with the identity: a single transform keeps its exact bits.
            pose = Some(pose.map_or(step, |below| step * below));
        }
        Ok(pose.unwrap_or_default())
    }

    /// Takes coordinates of `frame` to `to`, when neither moves against their nearest common ancestor.
    pub(super) fn fixed_between(&self, frame: &str, to: &str) -> Result<Pose, NoTransform> {
        let (from, onto) = (self.ancestry(frame)?, self.ancestry(to)?);
        let not_connected = || NoTransform::NotConnected {
            frame: frame.to_owned(),
            to: to.to_owned(),
            root: from.last().cloned().unwrap_or_default(),
        };
        let meeting = from.iter().find(|frame| onto.contains(frame)).ok_or_else(not_connected)?;
        let below =
            |frames: &[String]| frames.iter().take_while(|frame| *frame != meeting).cloned().collect();
        let up = self.fixed_pose(below(&from)).ok_or_else(not_connected)?;
        let down = self.fixed_pose(below(&onto)).ok_or_else(not_connected)?;
        Ok(down.inverse() * up)
    }

    /// The product of the transforms of `children`; `None` when one of them changes over time.
    fn fixed_pose(&self, children: Vec<String>) -> Option<Pose> {
        let mut pose = Pose::identity();
        for child in children {
            let step = match &self.edges.get(&child)?.motion {
                Motion::Fixed(fixed) => *fixed,
                Motion::Moving(trajectory) => {
                    let first = trajectory.poses().first()?.world_from_camera;
                    let stays = |pose: &StampedPose| pose.world_from_camera == first;
                    if !trajectory.poses().iter().all(stays) {
                        return None;
                    }
                    first
                }
                Motion::Listed(_) => return None,
            };
            pose = step * pose;
        }
        Some(pose)
    }

    /// A frame and all its ancestors.
    fn ancestry(&self, frame: &str) -> Result<Vec<String>, NoTransform> {
        let mut frames = vec![frame_name(frame).to_owned()];
        while let Some(edge) = frames.last().and_then(|frame| self.edges.get(frame)) {
            if frames.contains(&edge.parent) {
                return Err(NoTransform::Loop { frame: frame.to_owned() });
            }
            frames.push(edge.parent.clone());
        }
        Ok(frames)
    }
}

/// Whether a frame hardly moves between the two transforms around a time: see [`STILL`].
fn is_still(trajectory: &Trajectory, timestamp: f64) -> bool {
    let poses = trajectory.poses();
    let after = poses.partition_point(|pose| pose.timestamp <= timestamp);
    let around = after.checked_sub(1).and_then(|before| poses.get(before)).zip(poses.get(after));
    around.is_some_and(|(before, after)| {
        let (before, after) = (&before.world_from_camera, &after.world_from_camera);
        before.distance(after) < STILL[0] && before.angle(after) < STILL[1]
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "tests")]
mod tests {
    use super::*;
    use crate::ros2::messages::{Header, Rotation, Time, Vector3};

    fn at(parent: &str, child: &str, seconds: i32, x: f64) -> TransformStamped {
        TransformStamped {
            header: Header { stamp: Time { sec: seconds, nanosec: 0 }, frame_id: parent.into() },
            child_frame_id: child.into(),
            transform: Transform {
                translation: Vector3 { x, y: 0.0, z: 0.0 },
                rotation: Rotation { x: 0.0, y: 0.0, z: 0.0, w: 1.0 },
            },
        }
    }

    #[test]
    fn a_wrong_transform_keeps_no_other_of_its_message_out() {
        let mut wrong = at("map", "lamp", 1, 0.0);
        wrong.transform.rotation.w = 0.0;
        let mut tree = TransformTree::default();
        let message = [wrong, at("map", "map", 1, 0.0), at("map", "camera", 1, 2.0)];
        let error = tree.add_all(&message, false, None).unwrap_err();
        assert!(!error.contains("two different frames"), "the first that is wrong: {error}");
        tree.settle().unwrap();
        let chain = tree.chain_to_world("camera", None).unwrap();
        assert_eq!(tree.pose_at(&chain, 1.0, 0.2).unwrap().translation()[0], 2.0);
    }

    #[test]
    fn what_has_no_stamp_counts_when_it_was_recorded() {
        let mut tree = TransformTree::default();
        let unstamped = at("odom", "camera", 0, 2.0);
        assert!(tree.add(&unstamped, false, None).is_err());
        assert!(!tree.has_parent("camera"), "what is refused leaves nothing behind");
        tree.add(&unstamped, false, Some(1.0)).unwrap();
        tree.settle().unwrap();
        let chain = tree.chain_to_world("camera", None).unwrap();
        assert_eq!(tree.pose_at(&chain, 1.0, 0.2).unwrap().translation()[0], 2.0);
    }

    #[test]
    fn a_localization_may_be_slow_where_it_hardly_moves() {
        let mut tree = TransformTree::default();
        for (seconds, x) in [(1, 0.0), (2, 0.01), (3, 0.5)] {
            tree.add(&at("map", "camera", seconds, x), false, None).unwrap();
        }
        tree.settle().unwrap();
        let chain = tree.chain_to_world("camera", None).unwrap();
        let pose = |time: f64| tree.pose_at(&chain, time, 0.2);
        assert!((pose(1.5).unwrap().translation()[0] - 0.005).abs() < 1e-12);
        assert!(matches!(pose(2.5), Err(NoTransform::Uncovered { .. })));
        assert!(matches!(pose(3.5), Err(NoTransform::Uncovered { .. })));
    }
}
