use std::f32::consts::TAU;

use parry3d::math::{Pose3, Rot3, Vec3};

use super::smooth;
use super::walk::Walk;
use super::{Instance, Part};

/// An event in the room apart from its people's motion. No detector reports its thing as a mover: the thing
/// has no label, or the label of something that stays. Place and time are drawn from the seed.
///
/// A config is refused where there is no place for its events: where nothing in view can be moved so, or not
/// before the last frame; where all such things are in another event; or for a trolley in a building.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum SceneEvent {
    /// A trolley rolls through the room all the time.
    Trolley,
    /// A door on the wall opens into the room, stands open for three seconds and closes again.
    Door,
    /// A chair is pushed to another place, and stays there.
    PushedChair,
    /// A partition is put where nothing stood.
    PlacedPartition,
    /// A partition that stood there from the beginning is taken away.
    RemovedPartition,
}

/// An event in a scene: a thing, its motion and the time.
#[derive(Debug, Clone)]
pub(crate) struct Happening {
    pub(crate) event: SceneEvent,
    pub(crate) instance: usize,
    /// When the thing begins to move, and when it rests again, seconds.
    pub(crate) begin: f64,
    pub(crate) end: f64,
    pub(super) course: Course,
    /// The bodies of a thing that is gone at the end, in the scene's frame; a trolley's, in its own frame.
    pub(super) passing: Vec<Part>,
}

#[derive(Debug, Clone)]
pub(super) enum Course {
    Rolls(Walk),
    /// Opens to an angle about the z axis of a hinge.
    Swings {
        scene_from_hinge: Pose3,
        angle: f32,
    },
    /// Slides from one place to the other.
    Slides {
        from: Place,
        to: Place,
    },
    Appears,
    Vanishes,
}

/// Where a thing stands on the floor.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) at: [f32; 2],
    pub(super) yaw: f32,
}

/// The share of a door's time that opening takes, and closing; in between, it stands open.
const OPENING: f32 = 2.0 / 7.0;

impl Place {
    pub(super) fn scene_from_thing(&self) -> Pose3 {
        let [x, y] = self.at;
        Pose3::from_parts(Vec3::new(x, y, 0.0), Rot3::from_rotation_z(self.yaw))
    }

    /// The place after a share of the way to another; the yaw turns the shorter way round.
    pub(super) fn towards(&self, other: &Self, share: f32) -> Self {
        let turn = (other.yaw - self.yaw + 0.5 * TAU).rem_euclid(TAU) - 0.5 * TAU;
        let at = std::array::from_fn(|axis| self.at[axis] + share * (other.at[axis] - self.at[axis]));
        Self { at, yaw: self.yaw + share * turn }
    }
}

impl Happening {
    /// Whether the thing is in motion.
    pub(crate) fn moves(&self, time: f64) -> bool {
        (self.begin..self.end).contains(&time)
    }

    /// Whether at `time` the thing's place or presence is not what it is at the end.
    pub(crate) fn is_away(&self, time: f64) -> bool {
        match self.course {
            Course::Rolls(_) => true,
            Course::Swings { .. } => self.moves(time),
            Course::Slides { .. } | Course::Appears | Course::Vanishes => time < self.end,
        }
    }

    /// A body that stands at the end, at its pose of another time; `None` before the thing appears.
    pub(super) fn displaced(&self, part: &Part, time: f64) -> Option<Part> {
        let progress = ((time - self.begin) / (self.end - self.begin)).clamp(0.0, 1.0) as f32;
        let scene_from_scene = match &self.course {
            Course::Swings { scene_from_hinge, angle } => {
                let open = smooth(0.0, OPENING, progress) * smooth(1.0, 1.0 - OPENING, progress);
                let swung = Pose3::from_rotation(Rot3::from_rotation_z(open * angle));
                *scene_from_hinge * swung * scene_from_hinge.inverse()
            }
            Course::Slides { from, to } => {
                let place = from.towards(to, smooth(0.0, 1.0, progress));
                place.scene_from_thing() * to.scene_from_thing().inverse()
            }
            Course::Appears if time < self.end => return None,
            Course::Appears | Course::Rolls(_) | Course::Vanishes => Pose3::IDENTITY,
        };
        Some(Part { scene_from_part: scene_from_scene * part.scene_from_part, ..part.clone() })
    }

    /// The frame of the thing at rest, before or after the event.
    pub(super) fn scene_from_thing(&self, time: f64, thing: &Instance) -> Pose3 {
        match &self.course {
            Course::Slides { from, .. } if time < self.begin => from.scene_from_thing(),
            _ => thing.scene_from_thing,
        }
    }

    /// Adds the bodies, at `time`, of a thing that is gone at the end.
    pub(super) fn pose_passing(&self, time: f64, parts: &mut Vec<Part>) {
        let posed = |part: &Part| match &self.course {
            Course::Rolls(walk) => {
                let step = walk.at(time);
                let place = Place { at: step.position.to_array(), yaw: step.heading };
                Part { scene_from_part: place.scene_from_thing() * part.scene_from_part, ..part.clone() }
            }
            _ => part.clone(),
        };
        if self.is_away(time) {
            parts.extend(self.passing.iter().map(posed));
        }
    }
}
