use std::f32::consts::PI;

use dymlm_geometry::OrientedBox;
use parry3d::math::Vec3;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

use super::event::Place;
use super::staging::{GAP, posed};
use super::{Instance, Motion, Part, Scene, Stage, first_hit};
use crate::noise::{Use, stream};
use crate::to_pose::to_pose;
use crate::truth::box_around;

/// Labels of the things on the floor that people move about.
const MOVABLE: [&str; 4] = ["chair", "potted plant", "suitcase", "teddy bear"];
/// Shares of these things that stand elsewhere on another day, that are gone, and near which a second one of
/// their kind stands.
const MOVED: f64 = 0.25;
const GONE: f64 = 0.15;
const DOUBLED: f64 = 0.15;
/// Random places that are tried for each thing.
const TRIES: usize = 200;
/// Distance of the new place from the old one, metres.
const WAY: std::ops::Range<f32> = 1.0..3.0;
/// A height above all furniture, metres: if the line of sight between two places is free at this height, no
/// wall is between them.
const OVER_FURNITURE: f32 = 2.1;

/// Rearranges the things for another day.
impl Scene {
    /// Moves some things that nobody uses to free places off the camera's path, removes some and adds others,
    /// all drawn from the seed and the day.
    pub(crate) fn rearrange(&mut self, stage: &Stage<'_>, seed: u64, day: u64) {
        let [limbs, cameras] = self.clearances(stage);
        for instance in 0..self.instances.len() {
            let Some((from, parts)) = self.movable(instance) else { continue };
            if !limbs.is_kept_by(&posed(&parts, &from)) {
                continue;
            }
            let mut rng = stream(seed, Use::Scene, 4, (day << 14) ^ instance as u64);
            let fate = rng.random_range(0.0..1.0);
            if fate < GONE {
                self.static_parts.retain(|part| part.instance != instance);
            } else if fate < GONE + MOVED + DOUBLED {
                let is_clear = |there: &[Part]| limbs.is_kept_by(there) && cameras.is_kept_by(there);
                let Some(to) = self.place_nearby(instance, &from, &parts, is_clear, &mut rng) else {
                    continue;
                };
                if fate < GONE + MOVED {
                    self.put(instance, &from, &to);
                } else {
                    self.double(instance, &to, &parts);
                }
            }
        }
    }

    /// The place of a labelled thing and its bodies in its own frame; `None` if the thing cannot be moved.
    fn movable(&self, instance: usize) -> Option<(Place, Vec<Part>)> {
        let thing = self.instances.get(instance)?;
        let pose = thing.scene_from_thing;
        let is_movable = thing.motion == Motion::Still
            && thing.label.is_some_and(|label| MOVABLE.contains(&label))
            && pose.translation.z.abs() < 0.01;
        let front = pose.rotation * Vec3::X;
        let place = Place { at: [pose.translation.x, pose.translation.y], yaw: front.y.atan2(front.x) };
        let own = self.static_parts.iter().filter(|part| part.instance == instance);
        let in_thing =
            |part: &Part| Part { scene_from_part: pose.inverse() * part.scene_from_part, ..part.clone() };
        is_movable.then(|| (place, own.map(in_thing).collect()))
    }

    /// A free place in the same room.
    fn place_nearby(
        &self,
        instance: usize,
        from: &Place,
        parts: &[Part],
        is_clear: impl Fn(&[Part]) -> bool,
        rng: &mut ChaCha8Rng,
    ) -> Option<Place> {
        let above = |place: &Place| Vec3::new(place.at[0], place.at[1], OVER_FURNITURE);
        (0..TRIES).find_map(|_| {
            let (sin, cos) = rng.random_range(-PI..PI).sin_cos();
            let far = rng.random_range(WAY);
            let at = [from.at[0] + far * cos, from.at[1] + far * sin];
            let to = Place { at, yaw: from.yaw + rng.random_range(-1.5..1.5) };
            let there = posed(parts, &to);
            let good = there.iter().all(|part| self.is_free(part, instance, GAP))
                && is_clear(&there)
                && first_hit(&self.static_parts, above(from), above(&to)).is_none();
            good.then_some(to)
        })
    }

    /// Adds a copy of a thing at another place.
    fn double(&mut self, instance: usize, place: &Place, parts: &[Part]) {
        let double = self.instances.len();
        let label = self.instances[instance].label;
        let scene_from_thing = place.scene_from_thing();
        self.instances.push(Instance { label, motion: Motion::Still, scene_from_thing });
        let parts = posed(parts, place).into_iter().map(|part| Part { instance: double, ..part });
        self.static_parts.extend(parts);
    }

    /// The box of a thing that stays; `None` if the scene has no such thing.
    pub(crate) fn place_of(&self, instance: usize) -> Option<OrientedBox> {
        let thing = self.instances.get(instance).filter(|thing| thing.motion == Motion::Still)?;
        let parts: Vec<&Part> = self.static_parts.iter().filter(|part| part.instance == instance).collect();
        (!parts.is_empty()).then(|| box_around(&to_pose(&thing.scene_from_thing), &parts))?
    }
}
