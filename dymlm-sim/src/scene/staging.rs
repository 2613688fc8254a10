//! Finds the places where events happen.

use std::f32::consts::{FRAC_PI_2, PI};

use parry3d::math::{Pose3, Rot3, Vec3};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::builder::Builder;
use super::clearance::Clearance;
use super::event::{Course, Happening, Place, SceneEvent};
use super::palette::FABRIC;
use super::{Instance, Motion, Part, Scene, Shape, first_hit, furniture};
use crate::noise::{Use, stream};

/// The cameras and times that the place of an event depends on.
pub(crate) struct Stage<'a> {
    /// Poses of the camera in the scene, spread over the sequence.
    pub(crate) cameras: &'a [Pose3],
    /// Tangents of the angles between which the camera sees well, to either side of its axis, for x and y.
    pub(crate) view: [[f32; 2]; 2],
    /// How long the sequence takes, seconds.
    pub(crate) duration: f64,
    /// Time of the last frame, seconds.
    pub(crate) last: f64,
    /// When events happen, seconds; `None`: at a random time.
    pub(crate) time: Option<f64>,
}

/// Places that are tried before an event is given up.
const TRIES: usize = 4000;
/// Distances to keep from other things, from the middles of moving limbs, and from the camera, metres.
pub(super) const GAP: f32 = 0.02;
const FROM_LIMBS: f32 = 0.2;
const FROM_CAMERA: f32 = 0.6;
/// Depths at which a thing is well seen, metres.
const SEEN: std::ops::Range<f32> = 0.8..3.6;
/// Smallest share of a thing's points that the camera must see on average.
const LEAST_SEEN: f32 = 0.35;
/// Width of partitions, metres.
const WIDTH: f32 = 0.9;
/// Steps in which a door's opening angle is tried, radians.
const STEP: f32 = 0.0875;
/// Speed of a pushed chair, metres a second.
const PUSHED: f64 = 0.7;
/// How long a door takes to open, stand open and close, seconds.
const DOOR: f64 = 7.0;

impl Scene {
    /// Adds an event; `None` when there is no place for it, or no frame afterwards that shows what it has
    /// changed for good. `number` makes the random choices of a scene's events differ.
    pub(crate) fn stage(
        &mut self,
        event: SceneEvent,
        stage: &Stage<'_>,
        [seed, number]: [u64; 2],
    ) -> Option<()> {
        let mut rng = stream(seed, Use::Scene, 3, number);
        let begin = rng.random_range(0.25..0.45) * stage.duration;
        let begin = stage.time.unwrap_or(begin);
        let mut happening = Happening {
            event,
            instance: self.instances.len(),
            begin,
            end: begin,
            course: Course::Appears,
            passing: Vec::new(),
        };
        match event {
            // In a building it would stand in the camera's way, and two would roll through each other.
            SceneEvent::Trolley if self.tour.is_some() || self.has_trolley() => return None,
            SceneEvent::Trolley => {
                (happening.begin, happening.end) = (f64::NEG_INFINITY, f64::INFINITY);
                happening.course = Course::Rolls(self.way.clone());
                happening.passing =
                    self.add(Motion::Moves, Place { at: [0.0; 2], yaw: 0.0 }, furniture::trolley);
            }
            SceneEvent::Door => {
                happening.end = begin + DOOR;
                happening.instance = self.door.filter(|&door| !self.is_in_an_event(door))?;
                happening.course = self.door_swing(stage, &mut rng)?;
            }
            SceneEvent::PushedChair => {
                let (instance, from, to) = self.place_for_chair(stage, begin, &mut rng)?;
                happening.end = begin + push_time(&from, &to);
                happening.instance = instance;
                happening.course = Course::Slides { from, to };
                self.put(instance, &from, &to);
            }
            SceneEvent::PlacedPartition | SceneEvent::RemovedPartition => {
                let place = self.place_for_partition(stage, &mut rng)?;
                let parts = self.add(Motion::Still, place, partition);
                if event == SceneEvent::PlacedPartition {
                    self.static_parts.extend(parts);
                } else {
                    (happening.course, happening.passing) = (Course::Vanishes, parts);
                }
            }
        }
        let is_for_good = !matches!(event, SceneEvent::Trolley | SceneEvent::Door);
        if is_for_good && happening.end > stage.last {
            return None;
        }
        self.happenings.push(happening);
        Some(())
    }

    fn has_trolley(&self) -> bool {
        self.happenings.iter().any(|happening| happening.event == SceneEvent::Trolley)
    }

    fn is_in_an_event(&self, instance: usize) -> bool {
        self.happening_to(instance).next().is_some()
    }

    /// Adds a thing and returns its bodies.
    fn add(&mut self, motion: Motion, place: Place, build: fn(&mut Builder, [f32; 2], f32)) -> Vec<Part> {
        let instance = self.instances.len();
        let scene_from_thing = place.scene_from_thing();
        self.instances.push(Instance { label: None, motion, scene_from_thing });
        parts_of(place, build).into_iter().map(|part| Part { instance, ..part }).collect()
    }

    /// Moves a thing for good.
    pub(super) fn put(&mut self, instance: usize, from: &Place, to: &Place) {
        let moved = to.scene_from_thing() * from.scene_from_thing().inverse();
        for part in self.static_parts.iter_mut().filter(|part| part.instance == instance) {
            part.scene_from_part = moved * part.scene_from_part;
        }
        self.instances[instance].scene_from_thing = to.scene_from_thing();
    }

    /// The door swings about one of the vertical edges of its front as far as nothing is in the way, at most
    /// 80 degrees; `None` if that is less than 40 degrees or the camera does not see the open door.
    fn door_swing(&self, stage: &Stage<'_>, rng: &mut ChaCha8Rng) -> Option<Course> {
        let door = self.door?;
        let leaf = self.static_parts.iter().find(|part| part.instance == door)?;
        let half = leaf.shape.half_extents();
        let side = if rng.random_range(0..2) == 0 { -1.0 } else { 1.0 };
        [side, -side].into_iter().find_map(|side| {
            let edge = Pose3::from_translation(Vec3::new(side * half.x, -half.y, 0.0));
            let scene_from_hinge = leaf.scene_from_part * edge;
            let leaf_at = |step: u8| {
                let swung = Pose3::from_rotation(Rot3::from_rotation_z(side * STEP * f32::from(step)));
                Part { scene_from_part: scene_from_hinge * swung * edge.inverse(), ..leaf.clone() }
            };
            let free = (1..=16).take_while(|&step| self.is_free(&leaf_at(step), door, f32::EPSILON));
            let widest = free.last().filter(|&widest| widest >= 8)?;
            let is_seen = self.share_seen(&[leaf_at(widest)], stage) > LEAST_SEEN;
            is_seen.then_some(Course::Swings { scene_from_hinge, angle: side * STEP * f32::from(widest) })
        })
    }

    /// A chair on which nobody sits, its place, and a place to which it can be pushed in a straight line
    /// before the last frame.
    fn place_for_chair(
        &self,
        stage: &Stage<'_>,
        begin: f64,
        rng: &mut ChaCha8Rng,
    ) -> Option<(usize, Place, Place)> {
        let [limbs, cameras] = self.clearances(stage);
        let chairs = (0..self.instances.len())
            .filter(|&id| self.instances[id].label == Some("chair") && !self.is_in_an_event(id));
        let chairs: Vec<(usize, Place, Vec<Part>)> = chairs
            .filter_map(|id| {
                let pose = self.instances[id].scene_from_thing;
                let front = pose.rotation * Vec3::X;
                let place =
                    Place { at: [pose.translation.x, pose.translation.y], yaw: front.y.atan2(front.x) };
                let own = self.static_parts.iter().filter(|part| part.instance == id);
                let parts: Vec<Part> = own
                    .map(|part| Part {
                        scene_from_part: pose.inverse() * part.scene_from_part,
                        ..part.clone()
                    })
                    .collect();
                let here = posed(&parts, &place);
                (limbs.is_kept_by(&here) && self.share_seen(&here, stage) > LEAST_SEEN)
                    .then_some((id, place, parts))
            })
            .collect();
        if chairs.is_empty() {
            return None;
        }
        (0..TRIES).find_map(|_| {
            let (id, from, parts) = &chairs[rng.random_range(0..chairs.len())];
            let (sin, cos) = rng.random_range(-PI..PI).sin_cos();
            let far = rng.random_range(0.8_f32..1.8);
            let to = Place {
                at: [from.at[0] + far * cos, from.at[1] + far * sin],
                yaw: from.yaw + rng.random_range(-1.5..1.5),
            };
            let fits = |share: f32| {
                let there = posed(parts, &from.towards(&to, share));
                there.iter().all(|part| self.is_free(part, *id, GAP)) && limbs.is_kept_by(&there)
            };
            let there = posed(parts, &to);
            let good = begin + push_time(from, &to) <= stage.last
                && [1.0, 0.8, 0.6, 0.4, 0.2].into_iter().all(fits)
                && cameras.is_kept_by(&there)
                && self.share_seen(&there, stage) > LEAST_SEEN;
            good.then_some((*id, *from, to))
        })
    }

    /// A place for a partition that roughly faces the camera.
    fn place_for_partition(&self, stage: &Stage<'_>, rng: &mut ChaCha8Rng) -> Option<Place> {
        let [limbs, cameras] = self.clearances(stage);
        (0..TRIES).find_map(|_| {
            let camera = stage.cameras[rng.random_range(0..stage.cameras.len())];
            let ahead = camera.rotation * Vec3::Z;
            let facing = ahead.y.atan2(ahead.x) + rng.random_range(-0.5..0.5);
            let (sin, cos) = facing.sin_cos();
            let far = rng.random_range(1.2_f32..3.4);
            let [x, y] = [camera.translation.x + far * cos, camera.translation.y + far * sin];
            let place = Place { at: [x, y], yaw: facing - FRAC_PI_2 + rng.random_range(-0.6..0.6) };
            let parts = parts_of(place, partition);
            let good = parts.iter().all(|part| self.is_free(part, usize::MAX, GAP))
                && limbs.is_kept_by(&parts)
                && cameras.is_kept_by(&parts)
                && self.share_seen(&parts, stage) > LEAST_SEEN;
            good.then_some(place)
        })
    }

    /// What things keep from people's limbs and from the camera.
    pub(super) fn clearances(&self, stage: &Stage<'_>) -> [Clearance; 2] {
        let limbs = Clearance::from_all(&self.limbs(stage), FROM_LIMBS);
        [limbs, Clearance::from_all(stage.cameras, FROM_CAMERA)]
    }

    /// Poses of all moving bodies, ten times a second.
    fn limbs(&self, stage: &Stage<'_>) -> Vec<Pose3> {
        let mut bodies = Vec::new();
        let mut limbs = Vec::new();
        for step in 0..=(10.0 * stage.duration) as u32 {
            self.moving_parts(f64::from(step) / 10.0, &mut bodies);
            limbs.extend(bodies.iter().map(|body| body.scene_from_part));
        }
        limbs
    }

    /// Whether a body keeps `gap` metres from all things but its own and the floor.
    pub(super) fn is_free(&self, body: &Part, instance: usize, gap: f32) -> bool {
        let reach = body.shape.half_extents().length() + gap;
        let near = |other: &&Part| {
            let apart = other.scene_from_part.translation - body.scene_from_part.translation;
            let is_room = matches!(other.shape, Shape::Interior(_));
            other.instance != instance
                && (is_room || apart.length() < reach + other.shape.half_extents().length())
        };
        let near: Vec<&Part> = self.static_parts.iter().filter(near).collect();
        samples(body).filter(|point| point.z > 0.03).all(|point| {
            near.iter().all(|other| {
                let gap = if matches!(other.shape, Shape::Interior(_)) { 0.0 } else { gap };
                !other.shape.reaches(other.scene_from_part.inverse_transform_point(point), gap)
            })
        })
    }

    /// Share of some bodies' points that the cameras see on average, with occlusion by all other things.
    fn share_seen(&self, parts: &[Part], stage: &Stage<'_>) -> f32 {
        let own = parts.first().map_or(usize::MAX, |part| part.instance);
        let others: Vec<Part> =
            self.static_parts.iter().filter(|part| part.instance != own).cloned().collect();
        let points = parts.iter().flat_map(|part| {
            let half = part.shape.half_extents();
            [-0.6, 0.0, 0.6].map(|share| part.scene_from_part * (share * half))
        });
        let points: Vec<Vec3> = points.collect();
        let mut seen = 0_u16;
        for camera in stage.cameras {
            for &point in &points {
                let local = camera.inverse_transform_point(point);
                let is_between = |c: f32, [low, high]: [f32; 2]| low * local.z < c && c < high * local.z;
                let is_in_view = SEEN.contains(&local.z)
                    && is_between(local.x, stage.view[0])
                    && is_between(local.y, stage.view[1]);
                seen += u16::from(is_in_view && first_hit(&others, camera.translation, point).is_none());
            }
        }
        f32::from(seen) / (points.len() * stage.cameras.len()).max(1) as f32
    }
}

/// How long a chair is pushed from one place to the other, seconds.
fn push_time(from: &Place, to: &Place) -> f64 {
    let way = Vec3::new(to.at[0] - from.at[0], to.at[1] - from.at[1], 0.0);
    f64::from(way.length()) / PUSHED
}

fn partition(b: &mut Builder, at: [f32; 2], yaw: f32) {
    furniture::partition(b, at, yaw, WIDTH, FABRIC);
}

fn parts_of(place: Place, build: fn(&mut Builder, [f32; 2], f32)) -> Vec<Part> {
    let mut builder = Builder::default();
    build(&mut builder, place.at, place.yaw);
    builder.parts
}

pub(super) fn posed(parts: &[Part], place: &Place) -> Vec<Part> {
    let scene_from_thing = place.scene_from_thing();
    parts
        .iter()
        .map(|part| Part { scene_from_part: scene_from_thing * part.scene_from_part, ..part.clone() })
        .collect()
}

/// Points of a body's bounding box at most 4 cm apart, in the scene.
fn samples(part: &Part) -> impl Iterator<Item = Vec3> + '_ {
    let half = part.shape.half_extents();
    let steps = (half / 0.02).ceil().max(Vec3::ONE);
    let along = move |axis: usize, k: u32| half[axis] * (2.0 * k as f32 / steps[axis] - 1.0);
    let count = move |axis: usize| 0..=steps[axis] as u32;
    count(0).flat_map(move |i| {
        count(1).flat_map(move |j| {
            count(2).map(move |k| part.scene_from_part * Vec3::new(along(0, i), along(1, j), along(2, k)))
        })
    })
}
