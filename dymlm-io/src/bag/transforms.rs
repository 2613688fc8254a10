use std::collections::BTreeMap;

use dymlm_core::Pose;

use crate::ros2::messages::{Transform, TransformStamped};
use crate::{StampedPose, Trajectory, UncoveredTime};

/// Between transforms that differ by less, metres and radians, it does not matter how long nothing was heard:
/// what is between them lies nearer than maps distinguish poses.
const STILL: [f64; 2] = [0.02, 0.0175];

/// Why tf gives no pose of a frame.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NoTransform {
    /// The frames are not connected.
    #[error("no transform takes frame {frame:?} to {to:?}: the tree ends at {root:?}")]
    NotConnected {
        /// The frame that the transform is of.
        frame: String,
        /// The frame that it should take to.
        to: String,
        /// The last frame above it.
        root: String,
    },
    /// Only fixed transforms are above the camera: nobody says where the robot is.
    #[error(
        "nothing moves frame {root:?} above {frame:?}: there are no poses (for a camera that stands still, name the world frame)"
    )]
    NoMotion {
        /// The camera's frame.
        frame: String,
        /// The last frame above it.
        root: String,
    },
    /// The transforms lead back to where they began.
    #[error("the transforms above frame {frame:?} are a loop")]
    Loop {
        /// The frame.
        frame: String,
    },
    /// A transform that is not known at the time.
    #[error("transform {parent:?} -> {child:?}: {fault}")]
    Uncovered {
        /// The frame that the transform takes to.
        parent: String,
        /// The frame that it is of.
        child: String,
        /// The time, and what is covered instead.
        fault: UncoveredTime,
    },
    /// The trajectory that is used instead of tf does not cover the time.
    #[error(transparent)]
    Trajectory(#[from] UncoveredTime),
}

/// How frames lie in others, over time. Built once all transforms are read: it does not matter when they come.
#[derive(Debug, Default)]
pub(super) struct TransformTree {
    edges: BTreeMap<String, Edge>,
    /// Transforms of a frame that has another parent already.
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
    /// As they are read.
    Listed(Vec<StampedPose>),
    Moving(Trajectory),
}

/// Frames from one up to another.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Chain {
    /// The frames below the last.
    children: Vec<String>,
}

pub(super) fn pose_of(transform: &Transform) -> Result<Pose, String> {
    let Transform { translation: t, rotation: r } = transform;
    Pose::new([t.x, t.y, t.z], [r.x, r.y, r.z, r.w]).map_err(|error| error.to_string())
}

/// tf of old has frames that begin with a slash.
pub(super) fn frame_name(frame: &str) -> &str {
    frame.strip_prefix('/').unwrap_or(frame)
}

impl TransformTree {
    /// Takes a transform in. `is_fixed` ones hold at all times; of two the later counts. One without a time
    /// stamp holds when it was `recorded`.
    pub(super) fn add(
        &mut self,
        given: &TransformStamped,
        is_fixed: bool,
        recorded: Option<f64>,
    ) -> Result<(), String> {
        let (parent, child) = (frame_name(&given.header.frame_id), frame_name(&given.child_frame_id));
        if parent.is_empty() || child.is_empty() || parent == child {
            return Err(format!("a transform {parent:?} -> {child:?}"));
        }
        let pose = pose_of(&given.transform)?;
        let edge = self.edges.entry(child.to_owned()).or_insert_with(|| Edge {
            parent: parent.to_owned(),
            motion: if is_fixed { Motion::Fixed(pose) } else { Motion::Listed(Vec::new()) },
        });
        if edge.parent != parent {
            *self.second_parents.entry((child.to_owned(), parent.to_owned())).or_default() += 1;
            return Ok(());
        }
        match &mut edge.motion {
            Motion::Fixed(fixed) if is_fixed => *fixed = pose,
            Motion::Listed(poses) if !is_fixed => {
                let stamp = given.header.stamp.seconds().or(recorded);
                let timestamp = stamp.ok_or("a moving transform without a time")?;
                poses.push(StampedPose { timestamp, world_from_camera: pose });
            }
            _ => return Err(format!("the transform {parent:?} -> {child:?} is both fixed and moving")),
        }
        Ok(())
    }

    /// Forgets how a frame moves.
    pub(super) fn remove(&mut self, child: &str) {
        self.edges.remove(frame_name(child));
    }

    pub(super) fn has_parent(&self, child: &str) -> bool {
        self.edges.contains_key(frame_name(child))
    }

    /// All transforms are in.
    pub(super) fn settle(&mut self) -> Result<(), dymlm_core::Error> {
        for edge in self.edges.values_mut() {
            if let Motion::Listed(poses) = &mut edge.motion {
                edge.motion = Motion::Moving(Trajectory::new(std::mem::take(poses))?);
            }
        }
        Ok(())
    }

    /// From a frame up to the world: to the frame of that name, or the root.
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

    /// Takes coordinates of the chain's first frame to its last.
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
            // One transform alone stays as it is to the last bit.
            pose = Some(pose.map_or(step, |below| step * below));
        }
        Ok(pose.unwrap_or_default())
    }

    /// How one frame lies in another that never moves against it, by way of what is above both.
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

    /// The product of transforms that are fixed, or are the same every time.
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

    /// A frame, and all above it.
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

/// Whether a frame is where it was between the two transforms around a time.
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

    #[test]
    fn a_localization_may_be_slow_where_it_hardly_moves() {
        let at = |parent: &str, child: &str, seconds: i32, x: f64| TransformStamped {
            header: Header { stamp: Time { sec: seconds, nanosec: 0 }, frame_id: parent.into() },
            child_frame_id: child.into(),
            transform: Transform {
                translation: Vector3 { x, y: 0.0, z: 0.0 },
                rotation: Rotation { x: 0.0, y: 0.0, z: 0.0, w: 1.0 },
            },
        };
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
