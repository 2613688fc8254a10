use parry3d::math::Pose3;
use rand::RngExt;

use super::builder::Builder;
use super::material::Pattern::{Checker, Noise, Stripes};
use super::palette::PEOPLE;
use super::person::{Action, Clothes, Seat};
use super::walk::Walk;
use super::{Activity, Material, Person, furniture};
use crate::SequenceConfig;
use crate::noise::{Use, stream};

/// Who is in a room, and what they do there.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Cast {
    pub(super) activity: Activity,
    people: usize,
    /// Heights in metres and clothes.
    looks: [(f32, Clothes); 2],
    /// Two values of 0..1 for each person: speed and start of a walk, or the phase of a sitter's gestures.
    pub(super) choice: [[f64; 2]; 2],
}

impl Cast {
    /// The people of a sequence.
    pub(crate) fn new(config: &SequenceConfig) -> Self {
        let mut rng = stream(config.seed, Use::Scene, 0, 0);
        let choice = std::array::from_fn(|_| std::array::from_fn(|_| rng.random_range(0.0..1.0)));
        let looks =
            if config.strangers { [0, 1].map(|person| stranger(config.seed, person)) } else { PEOPLE };
        Self { activity: config.activity, people: config.people, looks, choice }
    }

    /// The usual two people, with every random choice at its middle.
    #[cfg(test)]
    pub(crate) fn usual(activity: Activity, people: usize) -> Self {
        Self { activity, people, looks: PEOPLE, choice: [[0.5; 2]; 2] }
    }

    /// Heights of the seats on which the two sit with their feet flat on the floor, metres.
    pub(super) fn seat_heights(&self) -> [f32; 2] {
        self.looks.map(|(height, _)| Person::seat_height(height))
    }

    /// Adds a chair for each of the two, present or not, and gives what they do on them.
    pub(super) fn sit(&self, b: &mut Builder, chairs: [([f32; 2], f32); 2]) -> [Action; 2] {
        for ((place, yaw), height) in chairs.into_iter().zip(self.seat_heights()) {
            furniture::swivel_chair(b, place, yaw, height);
        }
        [(chairs[0], self.choice[0][0]), (chairs[1], self.choice[1][0])]
            .map(|(chair, phase)| self.sits(chair, phase))
    }

    /// The action of somebody who sits on a chair.
    pub(super) fn sits(&self, (place, yaw): ([f32; 2], f32), phase: f64) -> Action {
        let Seat { position, heading, .. } = furniture::seat(place, yaw, phase);
        Action::Sits(Seat { position, heading, phase, types: self.activity == Activity::AtDesks })
    }

    /// Two walks along the given ways.
    pub(super) fn walk(&self, ways: [&[[f32; 2]]; 2]) -> [Walk; 2] {
        [(ways[0], self.choice[0]), (ways[1], self.choice[1])].map(|(way, [speed, start])| {
            // 0.6 to 1 m/s: an unhurried walk indoors.
            let speed = 0.6 + 0.4 * speed;
            let length = f64::from(Walk::new(way, speed, 0.0).length());
            Walk::new(way, speed, start * length)
        })
    }

    /// Adds the people to the scene.
    pub(super) fn enter(&self, b: &mut Builder, actions: [Action; 2]) {
        self.enter_room(b, actions, Pose3::IDENTITY);
    }

    /// Adds the people in a room at the given pose.
    pub(super) fn enter_room(
        &self,
        b: &mut Builder,
        actions: impl IntoIterator<Item = Action>,
        scene_from_room: Pose3,
    ) {
        for (action, (height, clothes)) in actions.into_iter().zip(self.looks).take(self.people) {
            b.person(action, scene_from_room, height, clothes);
        }
    }
}

/// Height and clothes of somebody drawn from a seed.
fn stranger(seed: u64, person: u64) -> (f32, Clothes) {
    let mut rng = stream(seed, Use::Scene, 4, person);
    let height = rng.random_range(1.66..1.84);
    let patterns = [Checker, Stripes, Noise];
    let mut cloth = |lightest: f32| {
        let pattern = patterns[rng.random_range(0..patterns.len())];
        let dark: [f32; 3] = std::array::from_fn(|_| rng.random_range(0.05..lightest));
        let light = dark.map(|c| c + rng.random_range(0.05..0.35));
        Material::new(pattern, rng.random_range(0.02..0.08), dark, light)
    };
    let [_, usual] = PEOPLE.map(|(_, clothes)| clothes);
    let clothes = Clothes {
        shirt: cloth(0.6),
        trousers: cloth(0.35),
        hair: cloth(0.45),
        shoes: cloth(0.3),
        skin: usual.skin,
    };
    (height, clothes)
}
