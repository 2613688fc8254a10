//! Rooms made up from a seed.

mod floor_plan;
mod furnishing;
mod station;
mod table_setting;
mod ways;

use rand::RngExt;

use self::furnishing::{Chair, Furnished};
use self::station::{Station, choose_station};
use self::ways::{CLEARANCE, are_seen, choose_ways, walks};
use super::palette::PEOPLE;
use super::person::Action;
use super::walk::Walk;
use super::{Activity, Scene, furniture};
use crate::noise::{Use, stream};

/// Rooms that are tried before one is given up.
const ATTEMPTS: u64 = 10_000;

/// A room with all that a sequence needs of it.
struct Plan {
    furnished: Furnished,
    station: Station,
    walks: [Walk; 2],
}

impl Scene {
    /// A room that nobody designed. Tables and seats are thrown in until they fit, things are put on them, a
    /// station is chosen that sees them, ways are sought over the free floor, and more furniture is put where
    /// none of them is; a room where something of this fails, or in which the station sees too little, is
    /// torn down and the next one begun. The room is the same whatever the people do in it.
    pub(super) fn random_room(activity: Activity, people: usize, seed: u64) -> Self {
        match (0..ATTEMPTS).find_map(|attempt| plan(seed, attempt)) {
            Some(plan) => plan.with_people(activity, people, seed),
            None => Self::two_tables(activity, people, [[0.5; 2]; 2]),
        }
    }
}

fn plan(seed: u64, attempt: u64) -> Option<Plan> {
    let mut rng = stream(seed, Use::Scene, 2, attempt);
    let mut furnished = Furnished::with_tables(&mut rng)?;
    let station = choose_station(&furnished, &mut rng)?;
    furnished.floor.take(station.footprint, 0.0);
    let ways = choose_ways(&furnished, &station, &mut rng)?;
    let samples = ways.iter().flat_map(|way| &way.samples).copied();
    furnished.floor.keep_free(samples, CLEARANCE);
    furnished.fill(&mut rng);
    // What was put up last may hide what was seen.
    let good = station.sees_enough(&furnished) && are_seen(&ways, &furnished, &station);
    let walks = walks(&ways, &mut rng)?;
    good.then_some(Plan { furnished, station, walks })
}

impl Plan {
    fn with_people(self, activity: Activity, people: usize, seed: u64) -> Scene {
        let mut rng = stream(seed, Use::Scene, 0, 0);
        let phase: [f64; 2] = std::array::from_fn(|_| rng.random_range(0.0..1.0));
        let seats = self.furnished.seats.iter().zip(phase);
        let sitting =
            |(chair, phase): (&Chair, f64)| Action::Sits(furniture::seat(chair.place, chair.yaw, phase));
        let way = self.walks[1].ahead();
        let actions: Vec<Action> = match activity {
            Activity::Walking => self.walks.into_iter().map(Action::Walks).collect(),
            Activity::Sitting => seats.map(sitting).collect(),
        };
        let mut b = self.furnished.builder;
        for (action, (height, clothes)) in actions.into_iter().zip(PEOPLE).take(people) {
            b.person(action, height, clothes);
        }
        Scene::of(b, self.station.viewpoint(), way)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rooms_are_full_and_differ() {
        let rooms: Vec<Scene> = (0..4).map(|seed| Scene::random_room(Activity::Walking, 2, seed)).collect();
        for room in &rooms {
            let labelled = room.instances.iter().filter(|thing| thing.label.is_some()).count();
            assert!(room.static_parts.len() > 60 && labelled > 14, "{labelled} labelled things");
        }
        let sizes: Vec<_> = rooms.iter().map(|room| room.static_parts[0].shape.half_extents()).collect();
        assert!((0..4).all(|i| (0..i).all(|j| sizes[i].distance(sizes[j]) > 0.01)), "{sizes:?}");
    }

    #[test]
    fn the_room_is_the_same_whatever_people_do() {
        let places = |activity, people| -> Vec<_> {
            let room = Scene::random_room(activity, people, 5);
            room.static_parts.iter().map(|part| part.scene_from_part).collect()
        };
        assert_eq!(places(Activity::Walking, 2), places(Activity::Sitting, 1));
    }
}
